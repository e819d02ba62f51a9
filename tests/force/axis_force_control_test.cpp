#include <kr5/force/axis_force_control.hpp>

#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/robot/loopback.hpp>

namespace axis_force_control_test {

using namespace kr5;
using namespace kr5::force;
using robot::CommandFrame;
using robot::LoopbackRobot;

namespace {

constexpr double stiffness = 23.38e3;  // [N/m]

/// A wall that pushes back along `normal` behind a point, without friction.
LoopbackRobot::Environment wall(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  return [=](const Pose& T_base_tool) {
    Vector6 out = Vector6::Zero();
    out.head<3>() = stiffness * std::max(0.0, normal.dot(point - T_base_tool.translation())) * normal;
    return out;
  };
}

Pose leaned() { return to_pose((Vector6() << 0.4, -0.2, 0.6, 0.7, -1.9, 0.4).finished()); }

}  // namespace

TEST_CASE("over a loopback robot the loop reaches its force along its axis, and moves nowhere else") {
  const CorrectionReference reference = GENERATE(CorrectionReference::Start, CorrectionReference::Actual);
  const CommandFrame frame = GENERATE(CommandFrame::Base, CommandFrame::Tool);
  CAPTURE(name_of(reference), name_of(frame));
  const Pose start = leaned();
  AxisForceOptions options;
  options.loop.correction = reference;
  options.loop.gain = reference == CorrectionReference::Start ? 5e-6 : 2e-6;
  options.frame = frame;
  options.axis = Eigen::Vector3d(0.3, -0.5, 2.0);
  const Eigen::Vector3d into =
      (frame == CommandFrame::Base ? options.axis : Eigen::Vector3d(start.linear() * options.axis)).normalized();
  LoopbackRobot robot({.limits = {.translation = 1e-4}, .force_noise = 0.05, .torque_noise = 0.005, .seed = 4});
  robot.place(start);
  robot.set_environment(wall(start.translation(), -into));
  AxisForceControl control(options);
  double sum = 0.0;
  for (int k = 0; k < 1500; ++k) {
    const robot::RobotReading reading = robot.read();
    robot.send(control.step(reading, 20.0));
    if (k >= 1400) sum += control.measured(reading);
  }
  CHECK(sum / 100 == Approx(20.0).margin(0.1));
  const Pose end = robot.T_base_tool();
  const Eigen::Vector3d way = end.translation() - start.translation();
  CHECK(way.cross(into).norm() < 1e-9);
  CHECK(way.dot(into) == Approx(20.0 / stiffness).epsilon(0.02));
  CHECK(end.linear().isApprox(start.linear(), 1e-12));
}

TEST_CASE("a reading that is no number moves nothing, before the loop began and afterwards") {
  AxisForceControl control({});
  robot::RobotReading reading;
  reading.T_base_tool = leaned();
  robot::RobotReading bad = reading;
  bad.T_base_tool.translation().x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(control.step(bad, 10.0).space == robot::CommandSpace::None);
  const Pose first = control.step(reading, 10.0).tool;
  CHECK(first.translation() != reading.T_base_tool.translation());
  bad = reading;
  bad.wrench[1] = std::numeric_limits<double>::quiet_NaN();
  CHECK(control.step(bad, 10.0).tool.isApprox(first));
  CHECK(control.loop().limited());
}

TEST_CASE("an axis that is none is refused by name") {
  CHECK_THROWS_WITH(AxisForceControl({.axis = Eigen::Vector3d::Zero()}), Catch::Contains("axis"));
  CHECK_THROWS_WITH(AxisForceControl({.loop = {.gain = -1.0}}), Catch::Contains("gain"));
}

}  // namespace axis_force_control_test
