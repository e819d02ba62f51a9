#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>

#include <kr5/calibration/repeatability.hpp>
#include <kr5/core/random.hpp>
#include <kr5/uncertainty/confidence.hpp>
#include <support/rates.hpp>
#include <support/trials.hpp>

namespace repeatability_test {

using namespace kr5;
using namespace kr5::calibration;

namespace {

/// Returns to points that the arm reaches with a known scatter, one after the other.
struct ReturnsWorld {
  Eigen::Vector3d position = {1e-4, 1e-4, 1e-4};  ///< Standard deviations along x, y, z [m].
  double rotation = 2e-4;                         ///< Per axis [rad].
  Vector6 offset = Vector6::Zero();               ///< Of the mean from the command, right perturbation.
  int points = 1;

  Pose command(int point) const {
    return from_xyzrpy((Vector6() << 0.8 + 0.1 * point, 0.1 * point, 0.4, 3.0, 0.2, 0.5 * point).finished());
  }
  std::vector<PoseReturn> draw(int count, std::uint64_t seed) const {
    Random random(seed);
    std::vector<PoseReturn> out;
    for (int k = 0; k < count; ++k)
      for (int p = 0; p < points; ++p) {
        Pose T = command(p) * to_pose(offset);
        T.translation() += position.cwiseProduct(Eigen::Vector3d(random.normal_vector(3)));
        T.linear() = T.linear() * exp_rotation(random.normal_vector(3, rotation));
        out.push_back({"P" + std::to_string(p + 1), T, ""});
      }
    return out;
  }
  std::vector<CommandedPose> commands() const {
    std::vector<CommandedPose> out;
    for (int p = 0; p < points; ++p) out.push_back({"P" + std::to_string(p + 1), command(p)});
    return out;
  }
};

/// Mean and deviation of the length of a normal vector with these standard deviations, by quadrature of the known
/// moments: E l^2 is exact, E l follows from a long sample.
double true_figure(const Eigen::Vector3d& sigma) {
  if (sigma[0] == sigma[1] && sigma[1] == sigma[2])  // Maxwell's distribution
    return sigma[0] * (2 * std::sqrt(2 / std::numbers::pi) + 3 * std::sqrt(3 - 8 / std::numbers::pi));
  Random random(99);
  double mean = 0.0;
  constexpr int draws = 400'000;
  for (int k = 0; k < draws; ++k) mean += sigma.cwiseProduct(Eigen::Vector3d(random.normal_vector(3))).norm() / draws;
  return mean + 3 * std::sqrt(sigma.squaredNorm() - mean * mean);
}

/// `at_least`: the true figure is zero, where no length can be too large and bounds hold more often than they say.
void check_covers(const char* what, int inside, int trials, bool at_least = false) {
  INFO(what << ": " << inside << " of " << trials);
  if (trials >= 1000) {
    CHECK(inside >= 0.93 * trials);
    CHECK((at_least || inside <= 0.97 * trials));
  } else {
    const auto rate = uncertainty::binomial_interval(inside, trials, 0.998);
    CHECK(rate.high > 0.95);
    CHECK((at_least || rate.low < 0.95));
  }
}

}  // namespace

TEST_CASE("RP of a point follows the standard's formula") {
  std::vector<PoseReturn> returns;
  const double x[] = {0.0, 3e-3, 0.0, -3e-3, 1e-3, -1e-3};
  for (const double v : x) {
    Pose T = Pose::Identity();
    T.translation() << v, 0, 0.5;
    returns.push_back({"P", T, ""});
  }
  const RepeatabilityResult r = measure_repeatability(returns);
  // Distances 0 3 0 3 1 1 mm: mean 4/3 mm, sum of squared deviations 20 - 6 * 16/9 = 28/3 mm^2, over n - 1 = 5.
  const double expected = 1e-3 * (4.0 / 3 + 3 * std::sqrt(28.0 / 3 / 5));
  REQUIRE(r.points.size() == 1);
  CHECK(r.points[0].RP.value == Approx(expected).epsilon(1e-12));
  CHECK(r.overall.RP.value == Approx(expected).epsilon(1e-12));
  CHECK(r.points[0].RR.value == Approx(0.0).margin(1e-12));
  CHECK_FALSE(r.points[0].AP);
}

TEST_CASE("orientation figures are three deviations of A, B, C and need no upright tool") {
  const double pi = std::numbers::pi;
  for (const double pitch : {0.0, pi / 2}) {  // at the second A and C of the pose itself are not defined
    const Eigen::Matrix3d R = from_xyzrpy((Vector6() << 0, 0, 0, 0.3, pitch, 0.2).finished()).linear();
    std::vector<PoseReturn> returns;
    for (const double a : {-2e-3, 2e-3, -1e-3, 1e-3}) {
      Pose T = Pose::Identity();
      T.linear() = R * exp_rotation({0, 0, a});
      returns.push_back({"P", T, ""});
    }
    const PointRepeatability p = measure_repeatability(returns).points[0];
    CHECK(p.RR_A.value == Approx(3 * std::sqrt(10e-6 / 3)).epsilon(1e-6));
    CHECK(p.RR_B.value == Approx(0.0).margin(1e-9));
    CHECK(p.RR_C.value == Approx(0.0).margin(1e-9));
    CHECK(p.RR.value == Approx(1.5e-3 + 3 * std::sqrt(4 * 0.25e-6 / 3)).epsilon(1e-6));
  }
}

TEST_CASE("accuracy is the distance of the mean from the command") {
  ReturnsWorld w;
  w.offset << 1e-3, -2e-3, 2e-3, 0, 0, 5e-3;
  const RepeatabilityResult r = measure_repeatability(w.draw(30, 3), w.commands());
  const PointRepeatability& p = r.points[0];
  REQUIRE(p.AP);
  CHECK(p.AP->value == Approx(3e-3).margin(4 * 1e-4 / std::sqrt(30.0)));
  CHECK(p.AR->value == Approx(5e-3).margin(4 * 2e-4 / std::sqrt(30.0)));
  CHECK((p.AP->low < 3e-3 && 3e-3 < p.AP->high));
  CHECK(p.offset[3] == Approx(5e-3).margin(4 * 2e-4 / std::sqrt(30.0)));  // A, about Z
}

TEST_CASE("the bounds of repeatability and accuracy hold the true figures in 95 %", "[coverage][statistics]") {
  ReturnsWorld w;
  const int kind = GENERATE(0, 1, 2);
  if (kind == 1) w.position = {3e-4, 1e-4, 1e-4}, w.offset << 2e-4, 0, 0, 0, 0, 0;
  if (kind == 2) w.position = {1e-4, 1e-4, 3e-5}, w.points = 3, w.offset << 0, 3e-5, 0, 1e-4, 0, 0;
  const int n = test::trials(2000, 60);
  const double RP = true_figure(w.position), RR = true_figure(Eigen::Vector3d::Constant(w.rotation));
  int rp = 0, rr = 0, a = 0, ap = 0, ar = 0, pooled = 0;
  for (int i = 0; i < n; ++i) {
    const RepeatabilityResult r =
        measure_repeatability(w.draw(30, 100 + static_cast<std::uint64_t>(i)), w.commands(), {.simulations = 600});
    const PointRepeatability& p = r.points[0];
    const auto holds = [](const BoundedFigure& f, double truth) { return f.low <= truth && truth <= f.high; };
    rp += holds(p.RP, RP), rr += holds(p.RR, RR), a += holds(p.RR_A, 3 * w.rotation);
    ap += holds(*p.AP, w.offset.head<3>().norm()), ar += holds(*p.AR, w.offset.tail<3>().norm());
    pooled += holds(r.overall.RP, RP);
  }
  CAPTURE(kind);
  check_covers("RP", rp, n), check_covers("RR", rr, n), check_covers("RR_A", a, n);
  check_covers("AP", ap, n, w.offset.head<3>().isZero()), check_covers("AR", ar, n, w.offset.tail<3>().isZero());
  check_covers("RP of all points", pooled, n);
}

TEST_CASE("a return that is off is named, and one of another point with that point") {
  ReturnsWorld w;
  w.points = 3;
  std::vector<PoseReturn> returns = w.draw(30, 5);
  returns[31].T.translation().z() += 2e-3;
  std::swap(returns[45].point, returns[46].point);
  const RepeatabilityResult all = measure_repeatability(returns);
  REQUIRE(all.outliers.size() == 3);
  CHECK(all.outliers[0].index == 31);
  CHECK(all.outliers[0].belongs_to.empty());
  CHECK(all.outliers[0].distance == Approx(2e-3).margin(5e-4));
  CHECK(all.outliers[1].index == 45);
  CHECK(all.outliers[1].belongs_to == "P1");
  CHECK(all.outliers[2].belongs_to == "P2");
  const RepeatabilityResult sound = measure_repeatability(returns, {}, {.leave_out_outliers = true});
  CHECK(all.overall.RP.value > 20e-3);
  CHECK(sound.overall.RP.value == Approx(true_figure(w.position)).epsilon(0.2));
  CHECK(sound.overall.returns == 87);
}

TEST_CASE("sound returns are rarely called outliers or drift, and drift is found", "[statistics]") {
  ReturnsWorld w;
  w.points = 2;
  const int n = test::trials(1000, 100);
  int outliers = 0, drifts = 0;
  for (int i = 0; i < n; ++i) {
    const RepeatabilityResult r =
        measure_repeatability(w.draw(30, 9000 + static_cast<std::uint64_t>(i)), {}, {.simulations = 200});
    outliers += !r.outliers.empty(), drifts += r.drift.significant;
  }
  test::check_rare(outliers, n, 0.03, test::full() ? 0.04 : 0.1);
  test::check_rare(drifts, n, 0.03, test::full() ? 0.04 : 0.1);
  std::vector<PoseReturn> warm = w.draw(30, 4);
  for (std::size_t k = 0; k < warm.size(); ++k)
    warm[k].T.translation().y() += 3e-4 * static_cast<double>(k) / static_cast<double>(warm.size() - 1);
  const ReturnDrift drift = measure_repeatability(warm).drift;
  CHECK(drift.significant);
  CHECK(drift.motion[1] == Approx(3e-4).margin(4 * drift.sigma[1]));
}

TEST_CASE("a device that turns is found although the points are held in different orientations") {
  Random random(31);
  std::vector<PoseReturn> returns;
  for (int k = 0; k < 60; ++k) {
    Pose T = Pose::Identity();
    if (k % 2) T.linear() = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    T.translation() << 0.1 * (k % 2), 0.0, 0.0;
    Vector6 noise;
    noise << random.normal_vector(3, 1e-5), random.normal_vector(3, 2e-5);
    const Eigen::AngleAxisd device(2e-4 * k / 59.0, Eigen::Vector3d::UnitX());
    T.linear() = device * T.linear();
    returns.push_back({k % 2 ? "b" : "a", T * to_pose(noise), ""});
  }
  const ReturnDrift drift = measure_repeatability(returns).drift;
  CHECK(drift.significant);
  CHECK(drift.motion[3] == Approx(2e-4).margin(4 * drift.sigma[3]));
}

TEST_CASE("returns that give no repeatability are refused") {
  ReturnsWorld w;
  std::vector<PoseReturn> returns = w.draw(5, 1);
  returns.push_back({"lonely", Pose::Identity(), ""});
  CHECK_THROWS_WITH(measure_repeatability(returns), Catch::Contains("point lonely has 1 return;"));
  returns.pop_back();
  CHECK_THROWS_WITH(measure_repeatability({}), Catch::Contains("at least one point"));
  CHECK_THROWS_WITH(measure_repeatability(returns, std::vector<CommandedPose>{{"P9", Pose::Identity()}}),
                    Catch::Contains("P9 has a command, but no returns"));
  returns[2].T.translation().x() = NAN;
  CHECK_THROWS_WITH(measure_repeatability(returns), Catch::Contains("return 3: the pose must be finite"));
  CHECK_THROWS_WITH(measure_repeatability(w.draw(5, 1), {}, {.confidence = 1.0}), Catch::Contains("confidence"));
}

}  // namespace repeatability_test
