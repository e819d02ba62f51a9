#include <limits>

#include <catch2/catch.hpp>

#include <calibration/scanner_world.hpp>
#include <kr5/core/error.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

namespace profile_features_test {

using namespace kr5;
using namespace kr5::test;
using Catch::Matchers::Contains;

namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();

/// A profile of a function of x, with noise.
template <class Range>
LineProfile profile_of(Range&& range, double noise, unsigned seed, int points = 200) {
  Random random(seed);
  LineProfile out;
  out.x = Eigen::VectorXd::LinSpaced(points, -0.05, 0.05);
  out.z.resize(points);
  for (int k = 0; k < points; ++k) out.z[k] = range(out.x[k]) + random.normal(noise);
  return out;
}

double ball(double x, double at, double depth, double radius, double floor) {
  const double inside = radius * radius - (x - at) * (x - at);
  return inside > 0 ? std::min(floor, depth - std::sqrt(inside)) : floor;
}

double pin(double x, double at, double depth, double slope, double floor) {
  return std::min(floor, depth + slope * std::abs(x - at));
}

}  // namespace

TEST_CASE("features of exact profiles are exact", "[profile]") {
  const ProfileFeature arc = find_profile_feature(
      profile_of([](double x) { return ball(x, 0.011, 0.19, 0.015, 0.2); }, 0.0, 1), ScanTargetKind::Sphere);
  REQUIRE(arc.fit.usable());
  CHECK((arc.points.col(0) - Eigen::Vector2d(0.011, 0.19)).norm() < 1e-7);
  CHECK(arc.radius == Approx(0.015).margin(1e-7));
  const ProfileFeature tip = find_profile_feature(
      profile_of([](double x) { return pin(x, -0.0123, 0.17, 2.0, 0.2); }, 0.0, 1), ScanTargetKind::Tip);
  REQUIRE(tip.fit.usable());
  CHECK((tip.points.col(0) - Eigen::Vector2d(-0.0123, 0.17)).norm() < 1e-7);
  const ProfileFeature line =
      find_profile_feature(profile_of([](double x) { return 0.2 + 0.3 * x; }, 0.0, 1), ScanTargetKind::Plane);
  REQUIRE(line.fit.usable());
  for (int k = 0; k < 2; ++k) CHECK(line.points(1, k) == Approx(0.2 + 0.3 * line.points(0, k)).margin(1e-9));
}

TEST_CASE("the covariances of features hold the truth", "[profile][coverage][statistics]") {
  const int trials = test::trials(2000, 150);
  Coverage tips("tip in a profile", 2), arcs("arc in a profile", 3), lines("line in a profile", 2);
  for (int trial = 0; trial < trials; ++trial) {
    Random random(1000 + static_cast<unsigned>(trial));
    const double at = random.uniform(-0.02, 0.02), noise = 3e-5, radius = random.uniform(0.010, 0.02);
    const auto seed = static_cast<unsigned>(trial);
    const ProfileFeatureOptions known{.sigma = noise};
    const ProfileFeature tip = find_profile_feature(
        profile_of([&](double x) { return pin(x, at, 0.17, 1.5, 0.2); }, noise, seed), ScanTargetKind::Tip, known);
    if (tip.fit.usable()) tips.add(tip.points.col(0) - Eigen::Vector2d(at, 0.17), tip.covariance);
    const ProfileFeature arc =
        find_profile_feature(profile_of([&](double x) { return ball(x, at, 0.19, radius, 0.2); }, noise, seed),
                             ScanTargetKind::Sphere, known);
    if (arc.fit.usable())
      arcs.add(Eigen::Vector3d(arc.points(0, 0) - at, arc.points(1, 0) - 0.19, arc.radius - radius), arc.covariance);
    const ProfileFeature line = find_profile_feature(
        profile_of([&](double x) { return 0.2 + at * x * 20; }, noise, seed), ScanTargetKind::Plane, known);
    const double cosine = 1 / std::hypot(1.0, at * 20);
    if (line.fit.usable())
      lines.add(cosine * Eigen::Vector2d(line.points(1, 0) - 0.2 - 20 * at * line.points(0, 0),
                                         line.points(1, 1) - 0.2 - 20 * at * line.points(0, 1)),
                line.covariance);
  }
  for (const Coverage* c : {&tips, &arcs, &lines}) {
    CHECK(c->trials() > 0.98 * trials);
    c->check_rate();
  }
}

TEST_CASE("holes, stray points and a step beside it do not move a feature", "[profile]") {
  LineProfile profile = profile_of([](double x) { return x > 0.035 ? 0.23 : ball(x, 0.0, 0.19, 0.015, 0.2); }, 2e-5, 3);
  for (Eigen::Index k = 0; k < profile.z.size(); k += 9) profile.z[k] = nothing;
  for (Eigen::Index k = 4; k < profile.z.size(); k += 10) profile.z[k] -= 0.02;  // a tenth
  const ProfileFeature arc = find_profile_feature(profile, ScanTargetKind::Sphere, {.radius = 0.015});
  REQUIRE(arc.fit.usable());
  CHECK((arc.points.col(0) - Eigen::Vector2d(0.0, 0.19)).norm() < 2e-4);
  CHECK(arc.radius == Approx(0.015).margin(2e-4));
  for (const int k : arc.used) CHECK((k % 10 != 4 && k % 9 != 0));
  LineProfile pointed = profile_of([](double x) { return pin(x, 0.01, 0.17, 2.0, 0.2); }, 2e-5, 4);
  pointed.z[20] = 0.13;  // a single reflection above the tip
  const ProfileFeature tip = find_profile_feature(pointed, ScanTargetKind::Tip);
  REQUIRE(tip.fit.usable());
  CHECK((tip.points.col(0) - Eigen::Vector2d(0.01, 0.17)).norm() < 2e-4);
}

TEST_CASE("a profile without the feature says so", "[profile]") {
  const LineProfile flat = profile_of([](double x) { return 0.2 + 0.1 * x; }, 2e-5, 5);
  CHECK_THAT(find_profile_feature(flat, ScanTargetKind::Tip).fit.message, Contains("the tip is not in it"));
  CHECK_THAT(find_profile_feature(flat, ScanTargetKind::Sphere, {.radius = 0.015}).fit.message, Contains("no arc"));
  const LineProfile round = profile_of([](double x) { return ball(x, 0, 0.3, 0.1, 0.5); }, 2e-5, 6);
  CHECK_THAT(find_profile_feature(round, ScanTargetKind::Sphere, {.radius = 0.015}).fit.message, Contains("no arc"));
  LineProfile empty = flat;
  empty.z.setConstant(nothing);
  CHECK_THAT(find_profile_feature(empty, ScanTargetKind::Plane).fit.message, Contains("found 0 measured points"));
  LineProfile millimetres = flat;
  millimetres.z *= 1000;
  CHECK_THROWS_WITH(find_profile_feature(millimetres, ScanTargetKind::Plane), Contains("millimetres"));
  LineProfile uneven = flat;
  uneven.z.conservativeResize(7);
  CHECK_THROWS_WITH(find_profile_feature(uneven, ScanTargetKind::Plane), Contains("expected as many"));
}

}  // namespace profile_features_test
