// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/friction.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>

namespace friction_test {

using namespace kr5;
using namespace kr5::physics;
using Eigen::ArrayXd;

namespace {

JointFriction full_friction() {
  JointFriction out;
  out.coulomb = 20.0, out.viscous = 15.0;
  out.stribeck = 8.0, out.stribeck_velocity = 0.1;
  out.load_coefficient = 0.2, out.driven_coefficient = 0.3;
  out.quadratic = 2.5;
  out.angle_amplitude = 4.0, out.angle_cycles = 3.0, out.angle_phase = 0.2;
  out.thermal_drop = 0.4, out.thermal_time_constant = 50.0;
  return out;
}

/// Where friction that depends on the angle is least.
const double trough = (1.5 * M_PI - 0.2) / 3.0;

}  // namespace

TEST_CASE("each part of the friction is what its formula says") {
  const JointFriction f = full_friction();
  CHECK(stribeck_friction(f, 0.0) == 8.0);
  CHECK(stribeck_friction(f, -0.1) == Approx(8.0 / std::exp(1.0)).epsilon(1e-14));
  CHECK(load_friction(f, -30.0) == Approx(6.0).epsilon(1e-14));
  CHECK(thermal_friction(f, 0.0) == 1.0);
  CHECK(thermal_friction(f, 50.0 * std::log(2.0)) == Approx(0.8).epsilon(1e-14));
  CHECK(angle_friction(f, 0.1) == Approx(4.0 * std::sin(0.5)).epsilon(1e-14));
  CHECK(angle_friction(f, 0.1 + 2 * M_PI / 3) == Approx(angle_friction(f, 0.1)).epsilon(1e-12));
  CHECK(quadratic_drag(f, -2.0) == -10.0);
  CHECK(driven_friction(f, 1.0, 30.0) == 0.0);  // the motor drives
  CHECK(driven_friction(f, -1.0, 30.0) == Approx(9.0).epsilon(1e-14));
  CHECK(driven_friction(f, 1.0, -30.0) == Approx(9.0).epsilon(1e-14));
  CHECK(dry_friction_level<double>(f, {trough, 0.0, 30.0, 0.0}) == Approx(30.0).epsilon(1e-14));
  // Fast, the sign is whole and the Stribeck part gone: (20 + 6 - 4 + 15 * 2 + 2.5 * 4) * 0.6 once warm.
  CHECK(joint_friction<double>(f, {trough, 2.0, 30.0, 1e6}) == Approx(37.2).epsilon(1e-12));
  CHECK(joint_friction<double>(f, {trough, -2.0, 30.0, 1e6}) == Approx(-42.6).epsilon(1e-12));  // and 9 more backwards
  CHECK(joint_friction<double>(f, {0.3, 0.0, 30.0, 10.0}) == 0.0);
}

TEST_CASE("friction takes energy out of every motion, and an angle of too little friction leaves none") {
  JointFriction f = full_friction();
  f.coulomb = 1.0, f.stribeck = 0.5;  // less than the amplitude
  CHECK(dry_friction_level<double>(f, {trough, 0.5, 0.0, 0.0}) == 0.0);
  for (const double torque : {-25.0, -1.0, 0.0, 3.0, 40.0})
    for (const double speed : {-1.0, -0.01, -0.001, 0.0005, 0.004, 0.7})
      for (const double q : {-1.0, 0.0, 0.4, 1.1, trough}) {
        CHECK(joint_friction<double>(f, {q, speed, torque, 20.0}) * speed >= 0.0);
        const FrictionRange dry = dry_friction_at(f, {q, speed, torque, 20.0});
        CHECK(dry.level >= std::abs(dry.offset));  // no motion is pushed, and none starts by itself
        CHECK(friction_slope_at(f, speed, 20.0) > 0.0);
      }
}

TEST_CASE("friction while the load drives is turned round with motion and load") {
  JointFriction f;
  f.coulomb = 2.0, f.driven_coefficient = 0.25;
  for (const double speed : {-0.4, 0.001, 0.3})
    for (const double torque : {-8.0, 5.0})
      CHECK(joint_friction<double>(f, {0.0, speed, torque, 0.0}) ==
            Approx(-joint_friction<double>(f, {0.0, -speed, -torque, 0.0})).epsilon(1e-14));
  const FrictionRange lifted = dry_friction_at(f, {0.0, 0.0, 8.0, 0.0});
  CHECK(lifted.along(1.0) == Approx(2.0));    // up: the motor drives
  CHECK(lifted.along(-1.0) == Approx(-4.0));  // down: 8 N m load drive it
  CHECK(lifted.along(0.0) == 0.0);
}

TEST_CASE("dry friction is smoothed over its speed: tanh(1) of the level there") {
  JointFriction f;
  f.coulomb = 10.0;
  CHECK(joint_friction<double>(f, {.speed = friction_smoothing_speed}) == Approx(10.0 * std::tanh(1.0)).epsilon(1e-14));
}

TEST_CASE("a motion in one call has the friction of its instants") {
  const JointFriction f = full_friction();
  const ArrayXd speed = ArrayXd::LinSpaced(201, -0.5, 0.5), torque = ArrayXd::LinSpaced(201, -40.0, 60.0),
                t = ArrayXd::LinSpaced(201, 0.0, 120.0), q = ArrayXd::LinSpaced(201, -1.0, 2.0);
  const ArrayXd whole = joint_friction<ArrayXd>(f, {q, speed, torque, t});
  for (Eigen::Index i = 0; i < speed.size(); ++i)
    CHECK(whole[i] ==
          Approx(joint_friction<double>(f, {q[i], speed[i], torque[i], t[i]})).epsilon(1e-13).margin(1e-13));
}

TEST_CASE("the dry part and what grows with the speed make the whole friction of a sliding joint") {
  const JointFriction f = full_friction();
  const double q = 0.6, t = 33.0;
  for (const double v : {-0.4, 0.4})  // tanh(v / 0.002) is of magnitude 1 to rounding
    for (const double torque : {-12.0, 12.0})
      CHECK(dry_friction_at(f, {q, v, torque, t}).along(v > 0 ? 1.0 : -1.0) + friction_slope_at(f, v, t) * v ==
            Approx(joint_friction<double>(f, {q, v, torque, t})).epsilon(1e-14));
}

TEST_CASE("only friction that grows with the load asks for the torque through the gear") {
  cell::Cell cell = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  CHECK_FALSE(JointFriction(cell, 1).needs_gear_torque());
  cell::set_effect(cell, "load_friction", "joint2", "coefficient", 0.02);
  CHECK(JointFriction(cell, 1).needs_gear_torque());
  CHECK_FALSE(JointFriction(cell, 0).needs_gear_torque());
  cell::set_effect(cell, "driven_friction", "joint1", "coefficient", 0.1);
  CHECK(JointFriction(cell, 0).needs_gear_torque());
  cell::set_effect(cell, "quadratic_drag", "joint3", "quadratic", 3.0);
  cell::set_effect(cell, "angle_friction", "joint3", "amplitude", 1.5);
  CHECK_FALSE(JointFriction(cell, 2).needs_gear_torque());
  CHECK(JointFriction(cell, 2).quadratic == 3.0);
  CHECK(JointFriction(cell, 2).angle_amplitude == 1.5);
  CHECK(JointFriction(cell, 2).angle_cycles == 1.0);
}

}  // namespace friction_test
