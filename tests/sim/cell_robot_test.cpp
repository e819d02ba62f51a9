// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/cell_robot.hpp>

#include <cmath>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/cell/sensor_model.hpp>
#include <kr5/core/error.hpp>

namespace cell_robot_test {

using namespace kr5;
using sim::CellRobot;
using sim::CellRobotOptions;

namespace {

constexpr double cycle = 0.004;  // [s]

cell::Cell arc() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

Eigen::VectorXd home() { return (Eigen::VectorXd(6) << 0.2, 0.3, -2.6, 0.4, -0.8, 0.3).finished(); }

CellRobotOptions quiet() {
  CellRobotOptions out;
  out.cycle = cycle;
  out.start = home();
  out.noise = false;
  return out;
}

robot::RobotCommand joints(const Eigen::VectorXd& q) {
  robot::RobotCommand out;
  out.space = robot::CommandSpace::Joints;
  out.joints = robot::joint_vector(q);
  return out;
}

robot::RobotCommand stop() {
  robot::RobotCommand out;
  out.stop = true;
  return out;
}

/// The first joint runs at a speed, all others stand.
Eigen::VectorXd ramp(double time, double speed) { return home() + speed * time * Eigen::VectorXd::Unit(6, 0); }

/// Cycles of that ramp; what the encoder of the first joint says after each, from its start.
std::vector<double> ramped(CellRobot& robot, int cycles, double speed) {
  std::vector<double> out;
  for (int i = 1; i <= cycles; ++i) {
    robot.send(joints(ramp(i * cycle, speed)));
    out.push_back(robot.read().joints[0] - home()[0]);
  }
  return out;
}

}  // namespace

TEST_CASE("joints follow after the delay of their servo, and lag on a ramp by that and 2 zeta / w") {
  CellRobot robot(arc(), quiet());
  const double speed = 0.1;
  const std::vector<double> x = ramped(robot, 200, speed);
  for (int i = 0; i < 3; ++i) CHECK(std::abs(x[static_cast<std::size_t>(i)]) < 1e-12);  // 12 ms
  CHECK(x[3] > 0.0);
  CHECK(x.back() == Approx(speed * (200 * cycle - 0.012 - 2 * 0.85 / 45.0)).epsilon(1e-6));
  CHECK((robot.read().joints.tail(5) - home().tail(5)).norm() < 1e-12);
  CHECK(robot.read().time == Approx(200 * cycle));
}

TEST_CASE("servo and delay are those of the cell with its effects, which no reading tells otherwise") {
  cell::Cell slow = arc();
  slow.effects.set("joint_delay", "drives", "delay", 0.030);
  CellRobot robot(slow, quiet());
  const double speed = 0.1;
  CHECK(ramped(robot, 200, speed).back() == Approx(speed * (200 * cycle - 0.030 - 2 * 0.85 / 45.0)).epsilon(1e-6));
}

TEST_CASE("the tool follows as the servo of the path does, in any cycle") {
  for (const double period : {0.004, 0.012}) {
    CellRobotOptions options = quiet();
    options.cycle = period;
    CellRobot robot(arc(), options);
    Pose wanted = robot.read().T_base_tool;
    const double before = wanted.translation().z();
    wanted.translation().z() += 0.01;
    const double w = 3.064, zeta = 0.7492, damped = w * std::sqrt(1 - zeta * zeta);
    double most = 0.0;
    for (int i = 1; i * period < 4.0; ++i) {
      robot.send(robot::tool_command(wanted));
      const double z = robot.read().T_base_tool.translation().z() - before;
      const double t = std::max(i * period - 0.024, 0.0);
      const double step =
          1 - std::exp(-zeta * w * t) * (std::cos(damped * t) + zeta * w / damped * std::sin(damped * t));
      REQUIRE(std::abs(z - 0.01 * step) < 1e-4);
      most = std::max(most, z);
    }
    CHECK(most == Approx(0.01 * (1 + std::exp(-M_PI * zeta / std::sqrt(1 - zeta * zeta)))).epsilon(2e-3));
    CHECK((robot.read().T_base_tool.linear() - wanted.linear()).norm() < 1e-4);
  }
}

TEST_CASE("limits of the path correction hold in the cycle of the cell") {
  cell::Cell cell = arc();
  cell.servo->correction = cell::Correction{.per_cycle = 0.0003, .total = 0.004};
  CellRobot robot(cell, quiet());
  Pose wanted = robot.read().T_base_tool;
  const Eigen::Vector3d before = wanted.translation();
  wanted.translation().x() += 0.05;
  for (int i = 0; i < 1500; ++i) robot.send(robot::tool_command(wanted));
  CHECK((robot.read().T_base_tool.translation() - before).x() == Approx(0.004).margin(1e-5));
}

TEST_CASE("a cell without servo of the path moves its tool by the joint servos") {
  cell::Cell cell = arc();
  cell.servo->tool.reset();
  CellRobot robot(cell, quiet());
  Pose wanted = robot.read().T_base_tool;
  wanted.translation().y() += 0.002;
  for (int i = 0; i < 100; ++i) robot.send(robot::tool_command(wanted));
  CHECK((robot.read().T_base_tool.translation() - wanted.translation()).norm() < 1e-6);
}

TEST_CASE("a stop brakes on the way of its deceleration, then the arm stands and can go on") {
  CellRobotOptions options = quiet();
  options.braking = 2.0;
  CellRobot robot(arc(), options);
  const double speed = 0.5;
  ramped(robot, 200, speed);
  const double at = robot.read().joints[0];
  double before = at;
  for (int i = 1; i * cycle < speed / 2.0; ++i) {
    robot.send(stop());
    const double now = robot.read().joints[0];
    REQUIRE(now > before);
    before = now;
  }
  for (int i = 0; i < 50; ++i) robot.send(stop());
  const robot::RobotReading rest = robot.read();
  CHECK(rest.joints[0] - at == Approx(speed * speed / (2 * 2.0)).epsilon(1e-3));
  CHECK(rest.status.stopped);
  for (int i = 0; i < 200; ++i) robot.send(joints(rest.joints));
  CHECK((robot.read().joints - rest.joints).norm() < 1e-9);
  CHECK_FALSE(robot.read().status.stopped);
}

TEST_CASE("commands that cannot be followed leave the arm where it is, and say so") {
  CellRobot robot(arc(), quiet());
  robot::RobotCommand unfit = joints(Eigen::VectorXd::Zero(3)), beyond = joints(home());
  beyond.joints[0] = 3.0;
  Pose far = robot.read().T_base_tool;
  far.translation().x() += 5.0;
  for (const robot::RobotCommand& bad : {unfit, beyond, robot::tool_command(far)}) {
    for (int i = 0; i < 20; ++i) robot.send(bad);
    CHECK_FALSE(robot.read().status.reachable);
    CHECK((robot.read().joints - home()).norm() < 1e-9);
  }
  robot.send(joints(home()));
  CHECK(robot.read().status.reachable);
}

TEST_CASE("where the arm thinks it is follows from the nominal cell, where it is from its effects") {
  cell::Cell real = arc();
  real.effects.set("link_length", "joint2", "a", 0.001);
  CellRobot robot(real, quiet()), sound(arc(), quiet());
  const Pose thought = robot.read().T_base_tool;
  CHECK((thought.translation() - cell::T_base_tool(arc(), home()).translation()).norm() < 1e-12);
  CHECK(robot.read().wrench.head<3>().norm() < 0.2);  // the weight of the tool is known
  CHECK((robot.actual().torque - sound.actual().torque).norm() > 0.01);
}

TEST_CASE("the wrist sensor feels what pushes the tool") {
  CellRobot robot(arc(), quiet());
  robot.set_environment(
      [](const Pose&, const Vector6&, double) { return (Vector6() << 0, 0, 20, 0, 0, 0).finished(); });
  for (int i = 0; i < 10; ++i) robot.send(joints(home()));
  CHECK(robot.read().wrench[2] == Approx(20).margin(0.2));
}

TEST_CASE("currents hold the arm, and efforts follow from them by the nominal drives") {
  cell::Cell weak = arc();
  weak.effects.set("torque_constant", "joint2", "torque_constant", 0.8 * 0.82);
  CellRobot sound(arc(), quiet()), other(weak, quiet());
  const robot::RobotReading a = sound.read(), b = other.read();
  REQUIRE((a.currents.size() == 6 && a.efforts.size() == 6));
  CHECK(a.efforts.cwiseAbs().maxCoeff() > 10.0);
  CHECK((a.efforts - sound.actual().torque).norm() < 1e-6);  // at rest there is no friction
  CHECK(std::abs(b.currents[1] / a.currents[1]) == Approx(1 / 0.8).epsilon(1e-6));
  CHECK(std::abs(b.efforts[1] / a.efforts[1]) == Approx(1 / 0.8).epsilon(1e-6));  // as the controller believes
}

TEST_CASE("noise is that of the cell, the same for the same seed") {
  CellRobotOptions options = quiet();
  options.noise = true;
  CellRobot a(arc(), options), b(arc(), options);
  options.seed = 2;
  CellRobot c(arc(), options);
  double sum = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const double off = a.read().joints[0] - home()[0];
    REQUIRE(off == b.read().joints[0] - home()[0]);
    REQUIRE(off != c.read().joints[0] - home()[0]);
    sum += off * off;
  }
  CHECK(std::sqrt(sum / 1000) == Approx(arc().noise.position).epsilon(0.1));
}

TEST_CASE("cells that cannot be commanded are refused with the missing part") {
  cell::Cell cell = arc();
  cell.servo.reset();
  CHECK_THROWS_WITH(CellRobot(cell), Catch::StartsWith("servo.joint"));
  cell = arc();
  cell.robot.links.clear();
  CHECK_THROWS_WITH(CellRobot(cell), Catch::StartsWith("robot.links"));
  CellRobotOptions options;
  options.start = Eigen::VectorXd::Zero(4);
  CHECK_THROWS_WITH(CellRobot(arc(), options), Catch::StartsWith("start"));
  options = {};
  options.cycle = 4.0;
  CHECK_THROWS_WITH(CellRobot(arc(), options), Catch::StartsWith("cycle"));
  options = {};
  options.braking = 0.0;
  CHECK_THROWS_WITH(CellRobot(arc(), options), Catch::StartsWith("braking"));
}

}  // namespace cell_robot_test
