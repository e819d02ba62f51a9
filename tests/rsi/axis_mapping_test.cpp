#include <kr5/rsi/axis_mapping.hpp>

#include <algorithm>
#include <cmath>
#include <random>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/rsi/kuka_pose.hpp>

#include "emulated_arm.hpp"

using namespace kr5;
using namespace kr5::rsi;

namespace axis_mapping_test {

constexpr double deg = M_PI / 180;

ControllerAxes drawn(std::mt19937& random) {
  ControllerAxes out{Eigen::VectorXd(6), Eigen::VectorXd(6)};
  for (int i = 0; i < 6; ++i) {
    out.sign[i] = random() % 2 ? 1 : -1;
    out.zero[i] = (static_cast<double>(random() % 4) - 1) * M_PI / 2;
  }
  return out;
}

double rounded(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  return std::round(value * scale) / scale;
}

/// What a telegram of some decimals tells of joint values.
AxisPoseRow told(const Eigen::VectorXd& q, const ControllerAxes& axes, const robot::SensorModel& model,
                 const Pose& T_active_base = Pose::Identity(), int decimals = 4) {
  AxisPoseRow out;
  out.axes = axes.axes(q).unaryExpr([&](double a) { return rounded(a / deg, decimals) * deg; });
  const Pose T = T_active_base * model.arm.flange(q) * model.T_flange_tool;
  out.pose = from_kuka(to_kuka(T).unaryExpr([&](double v) { return rounded(v, decimals); }));
  return out;
}

std::vector<AxisPoseRow> motion(std::mt19937& random, const ControllerAxes& axes, const robot::SensorModel& model,
                                const Pose& T_active_base = Pose::Identity(), int rows = 30) {
  std::uniform_real_distribution<double> angle(-1.2, 1.2);
  std::vector<AxisPoseRow> out;
  for (int k = 0; k < rows; ++k) {
    const Eigen::VectorXd q = Eigen::VectorXd::NullaryExpr(6, [&] { return angle(random); });
    out.push_back(told(q, axes, model, T_active_base));
  }
  return out;
}

bool is_same_turn(double a, double b) { return std::abs(std::remainder(a - b, 2 * M_PI)) < 1e-9; }

bool holds(const AxisMappingResult& result, const ControllerAxes& axes) {
  return std::ranges::any_of(result.mappings, [&](const AxisMapping& m) {
    for (int i = 0; i < 6; ++i)
      if (m.axes.sign[i] != axes.sign[i] || !is_same_turn(m.axes.zero[i], axes.zero[i])) return false;
    return true;
  });
}

/// The other mapping of a spherical wrist: the same poses, with the hand turned over.
ControllerAxes turned_over(ControllerAxes axes) {
  axes.zero[3] += M_PI;
  axes.sign[4] *= -1;
  axes.zero[4] *= -1;
  axes.zero[5] += M_PI;
  return axes;
}

TEST_CASE("each of 200 drawn mappings is found from telegrams of four decimals, with its other wrist and no third") {
  std::mt19937 random(5);
  const robot::SensorModel model = test::six_joints();
  for (int trial = 0; trial < 200; ++trial) {
    const ControllerAxes axes = drawn(random);
    const AxisMappingResult found = find_axis_mapping(motion(random, axes, model), model);
    INFO(trial);
    REQUIRE(found.status == MappingStatus::Found);
    REQUIRE(found.mappings.size() == 2);
    CHECK((holds(found, axes) && holds(found, turned_over(axes))));
    CHECK((found.frames_known && found.unmoved.empty() && found.free_zeros.empty()));
    CHECK((found.mappings[0].position_misfit < 1e-5 && found.mappings[0].rotation_misfit < 1e-5));
  }
}

TEST_CASE("the mapping is found with an unknown base and tool, but for zeros that are turns of those") {
  std::mt19937 random(6);
  robot::SensorModel model = test::six_joints();
  const Pose T_active_base = from_xyzrpy((Vector6() << 1.2, -0.4, 0.7, 0.3, -0.2, 2.0).finished());
  for (int trial = 0; trial < 40; ++trial) {
    const ControllerAxes axes = drawn(random);
    robot::SensorModel real = model;
    real.T_flange_tool = from_xyzrpy((Vector6() << 0.05, 0.1, 0.3, 0.5, 1.0, -0.4).finished());
    const AxisMappingResult found = find_axis_mapping(motion(random, axes, real, T_active_base), model);
    INFO(trial);
    REQUIRE_FALSE(found.mappings.empty());
    CHECK(found.status == MappingStatus::Found);
    CHECK_FALSE(found.frames_known);
    CHECK(found.free_zeros == std::vector<std::string>{"A1", "A6"});
    const auto ends = [](ControllerAxes a) {
      a.zero[0] = a.zero[5] = 0.0;
      return a;
    };
    CHECK((holds(found, ends(axes)) && holds(found, ends(turned_over(axes)))));
    CHECK(found.mappings[0].position_misfit < 1e-4);
  }
}

TEST_CASE("an arm without a spherical wrist has one mapping") {
  std::mt19937 random(7);
  robot::SensorModel model = test::six_joints();
  model.arm.joints[4].a = 0.05;
  const ControllerAxes axes = drawn(random);
  const AxisMappingResult found = find_axis_mapping(motion(random, axes, model), model);
  CHECK(found.status == MappingStatus::Found);
  CHECK((found.mappings.size() == 1 && holds(found, axes)));
}

TEST_CASE("an axis that does not move is named, and all mappings that fit are listed") {
  std::mt19937 random(8);
  const robot::SensorModel model = test::six_joints();
  ControllerAxes axes = drawn(random);
  axes.zero[1] = 0.0;
  std::vector<AxisPoseRow> rows;
  std::uniform_real_distribution<double> angle(-1.2, 1.2);
  for (int k = 0; k < 20; ++k) {
    Eigen::VectorXd q = Eigen::VectorXd::NullaryExpr(6, [&] { return angle(random); });
    q[1] = 0.0;  // both directions are the same
    rows.push_back(told(q, axes, model));
  }
  const AxisMappingResult found = find_axis_mapping(rows, model);
  CHECK(found.status == MappingStatus::NotMoved);
  CHECK(found.unmoved == std::vector<std::string>{"A2"});
  CHECK(found.mappings.size() == 4);
  ControllerAxes other = axes;
  other.sign[1] *= -1;
  CHECK((holds(found, axes) && holds(found, other)));
}

TEST_CASE("too few postures and another arm are told") {
  std::mt19937 random(9);
  const robot::SensorModel model = test::six_joints();
  const ControllerAxes axes = drawn(random);
  CHECK(find_axis_mapping({}, model).status == MappingStatus::TooFewRows);
  const AxisPoseRow one = motion(random, axes, model, Pose::Identity(), 1).front();
  const AxisMappingResult few = find_axis_mapping(std::vector<AxisPoseRow>(1000, one), model);
  CHECK((few.status == MappingStatus::TooFewRows && few.postures == 1 && few.unmoved.size() == 6));
  robot::SensorModel longer = model;
  longer.arm.joints[1].a = 0.8;
  const AxisMappingResult none = find_axis_mapping(motion(random, axes, model), longer);
  CHECK((none.status == MappingStatus::NothingFits && none.mappings.empty()));
  ControllerAxes odd = axes;
  odd.zero[2] += 0.4;
  CHECK(find_axis_mapping(motion(random, odd, model), model).status == MappingStatus::NothingFits);
}

TEST_CASE("an arm that differs from its model by millimetres has the same mapping") {
  std::mt19937 random(10);
  const robot::SensorModel model = test::six_joints();
  robot::SensorModel real = model;
  for (kinematics::DhJoint& j : real.arm.joints) j.a += 0.001, j.alpha += 0.002;
  for (int trial = 0; trial < 20; ++trial) {
    const ControllerAxes axes = drawn(random);
    const AxisMappingResult found = find_axis_mapping(motion(random, axes, real), model);
    CHECK((found.mappings.size() == 2 && holds(found, axes)));
    CHECK((found.status == MappingStatus::Found && found.mappings[0].position_misfit > 1e-3));
  }
}

TEST_CASE("options of the search, and its arm, are checked by their names") {
  AxisMappingOptions options;
  options.min_rows = 2;
  CHECK_THROWS_WITH(find_axis_mapping({}, test::six_joints(), options), Catch::StartsWith("min_rows"));
  options = {};
  options.rotation_tolerance = 0.0;
  CHECK_THROWS_WITH(find_axis_mapping({}, test::six_joints(), options), Catch::StartsWith("rotation_tolerance"));
  robot::SensorModel five = test::six_joints();
  five.arm.joints.pop_back();
  CHECK_THROWS_WITH(find_axis_mapping({}, five), Catch::StartsWith("model.arm"));
}

}  // namespace axis_mapping_test
