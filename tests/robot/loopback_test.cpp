#include <kr5/robot/loopback.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

namespace loopback_test {

using namespace kr5;
using namespace kr5::robot;

namespace {

Pose shifted(double x) { return Pose(Eigen::Translation3d(x, 0.0, 0.0)); }

/// Six axes with a wrist, as most industrial arms.
SensorModel six_axes() {
  SensorModel out;
  out.arm.joints = {{.b = 0.4, .a = 0.18, .alpha = M_PI_2},
                    {.theta_offset = M_PI_2, .a = 0.6, .alpha = M_PI},
                    {.a = 0.12, .alpha = M_PI_2},
                    {.b = 0.62, .theta_offset = M_PI, .alpha = M_PI_2},
                    {.theta_offset = -M_PI_2, .alpha = M_PI_2},
                    {.b = 0.115}};
  out.T_flange_tool = Pose(Eigen::Translation3d(0.0, 0.0, 0.19));
  return out;
}

JointVector bent() {
  JointVector out(6);
  out << 0.2, 0.4, -2.2, 0.1, -0.9, 0.3;
  return out;
}

}  // namespace

TEST_CASE("a command shows after its delay, in whole cycles, and time passes by cycles") {
  for (const int cycles : {1, 2, 5}) {
    LoopbackRobot robot({.cycle = 0.004, .delay = 0.004 * cycles});
    CHECK(robot.cycle() == 0.004);
    for (int k = 0; k < 10; ++k) {
      const RobotReading reading = robot.read();
      CHECK(reading.time == Approx(0.004 * k).margin(1e-12));
      CHECK(reading.T_base_tool.translation().x() == Approx(k < cycles ? 0.0 : 0.01 * (k - cycles + 1)));
      robot.send(tool_command(shifted(0.01 * (k + 1))));
    }
  }
}

TEST_CASE("limits of robot and command hold, the smaller one counts") {
  LoopbackRobot robot({.delay = 0.0, .limits = {.translation = 2e-3}});
  robot.send(tool_command(shifted(1.0)));
  CHECK(robot.T_base_tool().translation().x() == Approx(2e-3));
  RobotCommand slow = tool_command(shifted(1.0));
  slow.limits.translation = 5e-4;
  robot.send(slow);
  CHECK(robot.T_base_tool().translation().x() == Approx(2.5e-3));
}

TEST_CASE("noise has the stated size, comes from the seed, and does not move the robot") {
  const LoopbackOptions options{
      .position_noise = 1e-4, .rotation_noise = 1e-3, .force_noise = 0.2, .torque_noise = 0.01, .seed = 9};
  LoopbackRobot robot(options), twin(options);
  const int all = 4000;
  double position = 0, angle = 0, force = 0, torque = 0;
  for (int k = 0; k < all; ++k) {
    const RobotReading r = robot.read(), same = twin.read();
    REQUIRE((r.sensor == same.sensor && r.T_base_tool.matrix() == same.T_base_tool.matrix()));
    const Vector6 off = to_vector(r.T_base_tool);
    position += off.head<3>().squaredNorm() / (3 * all), angle += off.tail<3>().squaredNorm() / (3 * all);
    force += r.sensor.head<3>().squaredNorm() / (3 * all), torque += r.sensor.tail<3>().squaredNorm() / (3 * all);
  }
  const double within = 5.0 / std::sqrt(2.0 * 3 * all);  // five standard deviations of a standard deviation
  CHECK(std::sqrt(position) == Approx(1e-4).epsilon(within));
  CHECK(std::sqrt(angle) == Approx(1e-3).epsilon(within));
  CHECK(std::sqrt(force) == Approx(0.2).epsilon(within));
  CHECK(std::sqrt(torque) == Approx(0.01).epsilon(within));
  CHECK(robot.T_base_tool().matrix() == Pose::Identity().matrix());
}

TEST_CASE("an arm takes joints, and poses of its tool by the joints that are nearest; what it cannot reach it says") {
  LoopbackRobot robot({.delay = 0.0}, six_axes());
  robot.place(bent());
  const Pose start = robot.read().T_base_tool;
  CHECK(start.isApprox(six_axes().arm.flange(bent()) * six_axes().T_flange_tool, 1e-12));
  robot.send(tool_motion(Pose(Eigen::Translation3d(0.0, 0.0, 0.02)), CommandFrame::Tool));
  RobotReading after = robot.read();
  CHECK((start.inverse() * after.T_base_tool).translation().isApprox(Eigen::Vector3d(0, 0, 0.02), 1e-6));
  CHECK((after.joints - bent()).norm() < 0.2);
  RobotCommand joints;
  joints.space = CommandSpace::Joints;
  joints.joints = bent();
  robot.send(joints);
  CHECK(robot.read().T_base_tool.isApprox(start, 1e-9));
  robot.send(tool_command(Pose(Eigen::Translation3d(9.0, 0.0, 0.0))));
  after = robot.read();
  CHECK_FALSE(after.status.reachable);
  CHECK(after.T_base_tool.isApprox(start, 1e-9));
  CHECK_THROWS_AS(robot.place(Pose(Eigen::Translation3d(9.0, 0.0, 0.0))), InvalidArgument);
  joints.joints = JointVector::Zero(3);
  robot.send(joints);
  CHECK_FALSE(robot.read().status.reachable);
}

TEST_CASE("a stop stands until the next command, gripper and status are told") {
  LoopbackRobot robot({.delay = 0.0});
  RobotCommand stop = tool_command(shifted(1.0));
  stop.stop = true;
  stop.gripper = {.hold = false, .air = true};
  robot.send(stop);
  CHECK(robot.read().status.stopped);
  CHECK(robot.T_base_tool().translation().x() == 0.0);
  CHECK((robot.gripper().air && !robot.gripper().hold));
  robot.set_status(true, false);
  const RobotStatus status = robot.read().status;
  CHECK((status.saturated && !status.gripped && status.stopped));
  robot.send(tool_command(shifted(1.0)));
  CHECK_FALSE(robot.read().status.stopped);
}

TEST_CASE("options that are none are refused by name") {
  CHECK_THROWS_WITH(LoopbackRobot({.cycle = 0.0}), Catch::Contains("cycle"));
  CHECK_THROWS_WITH(LoopbackRobot({.delay = -1.0}), Catch::Contains("delay"));
  CHECK_THROWS_WITH(LoopbackRobot({.limits = {.joint = -1.0}}), Catch::Contains("joint"));
  CHECK_THROWS_WITH(LoopbackRobot({.force_noise = -1.0}), Catch::Contains("force_noise"));
}

}  // namespace loopback_test
