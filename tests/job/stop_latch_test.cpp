#include <kr5/job/stop_latch.hpp>

#include <functional>
#include <limits>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

namespace stop_latch_test {

using namespace kr5;
using namespace kr5::job;

StopLimits limits() {
  StopLimits out;
  out.sensor.current = Eigen::VectorXd::Constant(2, 5.0);
  out.lowest = {-0.5, -0.5, 0.0};
  out.highest = {0.5, 0.5, 1.0};
  return out;
}

/// A reading that nothing is wrong with.
robot::RobotReading good(int k) {
  robot::RobotReading out;
  out.time = 0.012 * k;
  out.T_base_tool.translation() = Eigen::Vector3d(0.001 * k, 0.0, 0.5);
  out.currents = Eigen::VectorXd::Constant(2, 1.0);
  out.sensor[0] = 0.01 * k;
  return out;
}

struct Case {
  StopReason reason;
  std::function<void(robot::RobotReading&)> spoil;
};

const std::vector<Case>& cases() {
  static const std::vector<Case> all = {
      {StopReason::Force, [](robot::RobotReading& r) { r.wrench[0] = 80.1; }},
      {StopReason::Torque, [](robot::RobotReading& r) { r.wrench[4] = -8.1; }},
      {StopReason::Current, [](robot::RobotReading& r) { r.currents[1] = -5.1; }},
      {StopReason::Current, [](robot::RobotReading& r) { r.currents.resize(0); }},
      {StopReason::SensorDead, [](robot::RobotReading& r) { r.wrench[2] = std::numeric_limits<double>::quiet_NaN(); }},
      {StopReason::SensorSaturated, [](robot::RobotReading& r) { r.status.saturated = true; }},
      {StopReason::Speed, [](robot::RobotReading& r) { r.T_base_tool.translation().y() = 0.013; }},
      {StopReason::Speed,
       [](robot::RobotReading& r) { r.T_base_tool.rotate(Eigen::AngleAxisd(0.08, Eigen::Vector3d::UnitX())); }},
      {StopReason::Workspace, [](robot::RobotReading& r) { r.T_base_tool.translation().z() = -0.001; }},
      {StopReason::LostLink, [](robot::RobotReading& r) { r.time += 0.11; }},
      {StopReason::LostLink, [](robot::RobotReading& r) { r.time -= 1; }},
      {StopReason::LostLink, [](robot::RobotReading& r) { r.T_base_tool.translation().x() = std::nan(""); }},
      {StopReason::Unreachable, [](robot::RobotReading& r) { r.status.reachable = false; }},
      {StopReason::Robot, [](robot::RobotReading& r) { r.status.stopped = true; }},
  };
  return all;
}

TEST_CASE("nothing stops an arm with which nothing is wrong") {
  StopLatch latch(limits());
  for (int k = 0; k < 500; ++k) REQUIRE(latch.step(good(k)) == StopReason::None);
}

TEST_CASE("each reason latches in its cycle, and holds the arm where it was measured, whatever comes") {
  for (const Case& c : cases()) {
    StopLatch latch(limits());
    for (int k = 0; k < 10; ++k) latch.step(good(k));
    robot::RobotReading bad = good(10);
    c.spoil(bad);
    INFO(name_of(c.reason));
    CHECK(latch.step(bad) == c.reason);
    const robot::GripperCommand holding{true, false};
    const robot::RobotCommand held = latch.hold(holding);
    CHECK(held.stop);
    CHECK(held.gripper.hold);
    CHECK(held.space == robot::CommandSpace::Tool);
    const bool told = bad.T_base_tool.matrix().allFinite();
    CHECK(held.tool.isApprox(told ? bad.T_base_tool : good(9).T_base_tool));
    for (int k = 11; k < 30; ++k) {
      CHECK(latch.step(good(k)) == c.reason);
      CHECK(latch.hold(holding).tool.isApprox(held.tool));
    }
  }
}

TEST_CASE("the limit of a phase holds beside that of the cell") {
  StopLatch latch(limits());
  robot::RobotReading pushed = good(0);
  pushed.wrench[1] = 40;
  CHECK(latch.step(pushed, 0.0) == StopReason::None);
  CHECK(latch.step(pushed, 30.0) == StopReason::Force);
}

TEST_CASE("a person and a link stop the arm from another thread, in the next cycle") {
  StopLatch by_person(limits()), by_link(limits());
  by_person.step(good(0));
  by_link.step(good(0));
  by_person.stop_by_operator();
  by_link.note_lost_link();
  CHECK(by_person.step(good(1)) == StopReason::Operator);
  CHECK(by_link.step(good(1)) == StopReason::LostLink);
}

TEST_CASE("a stop that stands from before is latched at once, without a pose until there is one") {
  StopLatch latch(limits(), StopReason::Torque);
  CHECK(latch.latched());
  CHECK(latch.hold({}).space == robot::CommandSpace::None);
  CHECK(latch.hold({}).stop);
  CHECK(latch.step(good(0)) == StopReason::Torque);
  CHECK(latch.hold({}).tool.isApprox(good(0).T_base_tool));
}

TEST_CASE("limits of a stop that are none are named") {
  StopLimits none = limits();
  none.speed = 0;
  CHECK_THROWS_WITH(StopLatch(none), "speed must lie between 0 and 100 m/s, so that it is a limit");
  none = limits();
  none.highest.y() = -0.5;
  CHECK_THROWS_WITH(StopLatch(none), "highest must lie above lowest in each axis [m]");
  none = limits();
  none.silence = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(StopLatch(none), "silence must lie between 0 and 60 s");
}

}  // namespace stop_latch_test
