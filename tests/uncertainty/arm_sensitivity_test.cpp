#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/kinematics/deviated_arm.hpp>
#include <kr5/uncertainty/sobol.hpp>

namespace arm_sensitivity_test {

using namespace kr5;
using namespace kr5::uncertainty;
using kinematics::DeviatedArm;

namespace {

constexpr double deg = M_PI / 180;
constexpr double sigma_length = 1e-3, sigma_angle = deg;
enum { X, Y, Z };

/// The arm of Hayat et al. 2022, Table 3.1, at the pose of their case 1.
DeviatedArm printed_kr5() {
  DeviatedArm arm;
  const double rows[6][4] = {{0.4, 0, 0.18, 90}, {0, 90, 0.6, 180}, {0, 0, 0.12, 90},
                             {0.62, 180, 0, 90}, {0, -90, 0, 90},   {0, 90, 0, 0}};
  for (const auto& [b, theta, a, alpha] : rows)
    arm.nominal.joints.push_back({.b = b, .theta_offset = theta * deg, .a = a, .alpha = alpha * deg});
  arm.q = (Eigen::VectorXd(6) << 0, 70, 12, 0, 0, 0).finished() * deg;
  arm.parameters = kinematics::joint_parameters(arm.nominal);
  return arm;
}

std::vector<UncertainInput> deviations_of(const DeviatedArm& arm) {
  std::vector<UncertainInput> out;
  for (const kinematics::JointParameter& p : arm.parameters)
    out.push_back({.name = p.label(), .sigma = p.is_length() ? sigma_length : sigma_angle});
  return out;
}

void keep_lengths(DeviatedArm& arm) {
  std::erase_if(arm.parameters, [](const kinematics::JointParameter& p) { return !p.is_length(); });
}

BatchModel model_of(const DeviatedArm& arm) {
  return [&arm](const Rows& x) { return arm.errors(x); };
}

int row_of(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
}

}  // namespace

TEST_CASE("the KR5 of the book at its pose: indices of all 24 parameters") {
  const DeviatedArm arm = printed_kr5();
  const SobolResult r = sobol_indices(model_of(arm), deviations_of(arm), {.samples = 1 << 14, .resolution = 1e-12});
  REQUIRE(r.inputs.size() == 24);
  const auto total = [&](const char* name, int output) { return r.total(row_of(r.inputs, name), output); };
  // Four digits of independent estimates: half a digit, and four standard errors of random rows, sqrt(2 S / N).
  const double margin = 0.0005 + 4 * std::sqrt(2.0 / (1 << 14)) * 0.5;
  CHECK(total("theta2", Z) == Approx(0.834).margin(margin));
  CHECK(total("theta3", Z) == Approx(0.156).margin(margin));
  CHECK(total("b1", Z) == Approx(0.0028).margin(3e-4));
  CHECK(total("theta1", Y) == Approx(0.453).margin(margin));
  CHECK(total("alpha3", Y) == Approx(0.263).margin(margin));
  CHECK(total("alpha2", Y) == Approx(0.231).margin(margin));
  CHECK(total("alpha1", Y) == Approx(0.045).margin(margin));
  CHECK(total("theta3", X) == Approx(0.724).margin(margin));
  CHECK(total("theta2", X) == Approx(0.224).margin(margin));
  const double deviation[] = {9.48e-3, 21.11e-3, 18.99e-3};  // of a normal law cut off at three
  for (int o = 0; o < 3; ++o) {
    CHECK(std::sqrt(r.variance[o]) == Approx(deviation[o]).epsilon(0.02));
    CHECK(r.total.col(o).sum() == Approx(1.0).margin(0.03));
    CHECK(r.first.col(o).sum() == Approx(1.0).margin(0.06));
  }
  // What the book says of it: b1 acts on Z alone, lengths on no orientation, b2 and b3 on Y.
  CHECK(total("b1", X) < 1e-12);
  CHECK(total("b1", Y) < 1e-12);
  for (const char* length : {"b1", "b2", "b4", "a1", "a6"})
    for (int o = 3; o < 6; ++o) CHECK(total(length, o) < 1e-12);
  CHECK(total("b2", Y) == Approx(total("b3", Y)).epsilon(0.1));
  CHECK(total("b2", X) < 1e-5);  // 1 mm turned by 1 degree, of 9.48 mm: 3e-6
  CHECK(total("alpha6", 3) + total("alpha6", 4) + total("alpha6", 5) > 0.05);  // against the book's list (I-04)
}

TEST_CASE("the lengths of the KR5 alone, at its pose and over the workspace") {
  DeviatedArm arm = printed_kr5();
  keep_lengths(arm);
  const auto inputs = deviations_of(arm);
  const SobolResult pose = sobol_indices(model_of(arm), inputs, {.samples = 1 << 14, .resolution = 1e-12});
  CHECK(pose.total(row_of(pose.inputs, "b1"), Z) == Approx(0.294).margin(0.01));
  for (const char* name : {"b2", "b3", "b5", "a6"})
    CHECK(pose.total(row_of(pose.inputs, name), Y) == Approx(0.25).margin(0.01));
  CHECK(pose.total.rightCols<3>().isZero());

  // Over the workspace: each index is the mean square of a direction cosine over that of all, here summed directly.
  arm.joints_vary = true;
  auto with_joints = inputs;
  for (int i = 0; i < 6; ++i)
    with_joints.push_back({.name = "q", .law = InputLaw::Uniform, .low = -2.6, .high = 1.9, .averaged = true});
  const SobolResult space = sobol_indices(model_of(arm), with_joints, {.samples = 1 << 14, .resolution = 1e-12});
  const auto d = static_cast<Eigen::Index>(arm.parameters.size());
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(d, 3);
  const Rows points = sobol_design(with_joints, 0, 4096, {.seed = 5});
  Rows one(d, d + 6);
  for (int i = 0; i < 4096; ++i) {
    one << Eigen::MatrixXd::Identity(d, d), points.row(i * (d + 2)).tail(6).replicate(d, 1);
    squares += arm.errors(one).leftCols<3>().cwiseAbs2();
  }
  for (int o = 0; o < 3; ++o)
    for (Eigen::Index k = 0; k < d; ++k) {
      CAPTURE(space.inputs[static_cast<std::size_t>(k)], o);
      CHECK(space.total(k, o) == Approx(squares(k, o) / squares.col(o).sum()).margin(0.01));
    }
  for (int o = 0; o < 2; ++o)  // axes 2 and 3 are parallel
    CHECK(space.total(row_of(space.inputs, "b2"), o) ==
          Approx(space.total(row_of(space.inputs, "b3"), o)).margin(0.01));
}

TEST_CASE("one parameter at a time: b1 moves the KR5 along Z alone") {
  const DeviatedArm arm = printed_kr5();
  const OneAtATime r = one_at_a_time(model_of(arm), deviations_of(arm));
  const int b1 = row_of(r.inputs, "b1");
  CHECK(r.plus(b1, Z) == Approx(1e-3).epsilon(1e-9));
  CHECK(r.minus(b1, Z) == Approx(-1e-3).epsilon(1e-9));
  CHECK(r.highest(b1, Z) - r.lowest(b1, Z) == Approx(6e-3).epsilon(1e-9));
  for (const int o : {0, 1, 3, 4, 5}) CHECK(std::abs(r.plus(b1, o)) < 1e-15);
  const int theta1 = row_of(r.inputs, "theta1");
  CHECK(r.minus(theta1, Y) == Approx(-r.plus(theta1, Y)).epsilon(1e-3));
  CHECK(std::abs(r.plus(theta1, Y)) == Approx(0.8141 * std::sin(deg)).epsilon(1e-3));
}

}  // namespace arm_sensitivity_test
