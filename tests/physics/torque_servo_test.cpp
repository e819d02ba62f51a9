#include <kr5/physics/torque_servo.hpp>

#include <limits>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>

#include "support/arm_cells.hpp"

namespace torque_servo_test {

using namespace kr5;

TEST_CASE("the torque of a servo is the sum of its parts, outside the dead band") {
  const cell::TorqueServo servo{
      .stiffness = 20.0, .damping = 2.0, .integral = 5.0, .feed_forward = 1.5, .dead_band = 0.1};
  CHECK(physics::servo_torque(servo, 0.3, 0.4, 0.2, 0.5) == Approx(20 * 0.2 + 5 * 0.4 + 1.5 * 0.2 - 2 * 0.5));
  CHECK(physics::servo_torque(servo, 0.05, 0.0, 0.0, 0.0) == 0.0);
  CHECK(physics::servo_torque(servo, -0.3, 0.0, 0.0, 0.0) == Approx(-4.0));
}

TEST_CASE("torque and supply voltage limit a servo, whichever is less") {
  cell::TorqueServo servo{.stiffness = 1000.0, .damping = 0.0};
  servo.torque_limit = 3.0;
  CHECK(physics::servo_torque(servo, 1.0, 0.0, 0.0, 0.0) == 3.0);
  CHECK(physics::servo_torque(servo, -1.0, 0.0, 0.0, 0.0) == -3.0);
  servo.stall_torque = 4.0;
  servo.no_load_speed = 8.0;
  CHECK(physics::servo_torque(servo, 1.0, 0.0, 0.0, 1.0) == 3.0);
  CHECK(physics::servo_torque(servo, 1.0, 0.0, 0.0, 4.0) == Approx(2.0));
  CHECK(physics::servo_torque(servo, 1.0, 0.0, 0.0, 8.0) == Approx(0.0).margin(1e-12));
  CHECK(physics::servo_torque(servo, -1.0, 0.0, 0.0, 4.0) == -3.0);  // against the motion
  CHECK(physics::servo_torque(servo, 1.0, 0.0, 0.0, -4.0) == 3.0);
}

TEST_CASE("a drive gives nothing of a torque within its dead band, and less by it of a greater one") {
  cell::TorqueServo servo{.stiffness = 20.0, .damping = 2.0, .torque_dead_band = 0.5};
  CHECK(physics::servo_torque(servo, 0.02, 0.0, 0.0, 0.0) == 0.0);
  CHECK(physics::servo_torque(servo, -0.025, 0.0, 0.0, 0.0) == 0.0);
  CHECK(physics::servo_torque(servo, 0.1, 0.0, 0.0, 0.0) == Approx(1.5));
  CHECK(physics::servo_torque(servo, -0.1, 0.0, 0.0, 0.0) == Approx(-1.5));
  CHECK(physics::servo_torque(servo, 0.1, 0.0, 0.0, 1.0) == 0.0);  // of all that is asked, damping included
  servo.torque_limit = 1.4;                                        // of what is given
  CHECK(physics::servo_torque(servo, 0.09, 0.0, 0.0, 0.0) == Approx(1.3));
  CHECK(physics::servo_torque(servo, 0.1, 0.0, 0.0, 0.0) == 1.4);
}

TEST_CASE("a lower supply voltage takes torque and speed in proportion, and none where no limit is stated") {
  cell::Cell cell = test::arm_cell({"rr"});
  cell.servo->joint.clear();
  cell.servo->torque = {{.stiffness = 1000.0, .stall_torque = 4.0, .no_load_speed = 8.0}, {.stiffness = 1000.0}};
  for (const char* joint : {"joint1", "joint2"}) cell::set_effect(cell, "servo_voltage", joint, "voltage", 0.75);
  const auto servos = physics::torque_servos(cell);
  CHECK(physics::servo_torque(servos[0], 1.0, 0.0, 0.0, 0.0) == Approx(3.0));
  CHECK(physics::servo_torque(servos[0], 1.0, 0.0, 0.0, 6.0) == Approx(0.0).margin(1e-12));
  // A motor in a current is slowed by its own voltage, whatever the supply: the slope stays.
  CHECK(physics::torque_bound(servos[0], 1.0, 0.0).slope == Approx(0.5));
  CHECK(physics::servo_torque(servos[1], 1.0, 0.0, 0.0, 6.0) == 1000.0);
}

TEST_CASE("effects of a torque servo replace its values; a limit holds beside that of the cell") {
  cell::Cell cell = test::arm_cell({"rrr"});
  CHECK(physics::torque_servos(cell).empty());
  cell.servo->joint.clear();
  cell.servo->torque = {{.stiffness = 20.0, .damping = 2.0}};
  cell.servo->torque[0].torque_limit = 5.0;
  cell::set_effect(cell, "servo_stiffness", "joint2", "stiffness", 12.0);
  cell::set_effect(cell, "servo_damping", "joint2", "damping", 3.0);
  cell::set_effect(cell, "servo_integral", "joint2", "integral", 4.0);
  cell::set_effect(cell, "servo_dead_band", "joint2", "dead_band", 0.01);
  cell::set_effect(cell, "torque_limit", "joint2", "torque", 2.0);
  cell::set_effect(cell, "torque_limit", "joint3", "torque", 9.0);
  cell::set_effect(cell, "torque_dead_band", "joint2", "torque", 0.3);
  cell::set_effect(cell, "joint_delay", "drives", "delay", 0.05);
  const auto servos = physics::torque_servos(cell);
  REQUIRE(servos.size() == 3);
  CHECK(servos[0].stiffness == 20.0);
  CHECK(servos[0].delay == 0.05);
  CHECK(servos[1].stiffness == 12.0);
  CHECK(servos[1].damping == 3.0);
  CHECK(servos[1].integral == 4.0);
  CHECK(servos[1].dead_band == 0.01);
  CHECK(servos[1].torque_limit == 2.0);
  CHECK(servos[1].torque_dead_band == 0.3);
  CHECK(servos[0].torque_dead_band == 0.0);
  CHECK(servos[2].torque_limit == 5.0);
}

}  // namespace torque_servo_test
