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
  out.load_coefficient = 0.2;
  out.thermal_drop = 0.4, out.thermal_time_constant = 50.0;
  return out;
}

}  // namespace

TEST_CASE("each part of the friction is what its formula says") {
  const JointFriction f = full_friction();
  CHECK(stribeck_friction(f, 0.0) == 8.0);
  CHECK(stribeck_friction(f, -0.1) == Approx(8.0 / std::exp(1.0)).epsilon(1e-14));
  CHECK(load_friction(f, -30.0) == Approx(6.0).epsilon(1e-14));
  CHECK(thermal_friction(f, 0.0) == 1.0);
  CHECK(thermal_friction(f, 50.0 * std::log(2.0)) == Approx(0.8).epsilon(1e-14));
  CHECK(dry_friction_level(f, 0.0, 30.0) == Approx(34.0).epsilon(1e-14));
  // Fast, the sign is whole and the Stribeck part gone: (20 + 6 + 15 * 2) * 0.6 once warm.
  CHECK(joint_friction(f, 2.0, 30.0, 1e6) == Approx(33.6).epsilon(1e-12));
  CHECK(joint_friction(f, 0.0, 30.0, 10.0) == 0.0);
  CHECK(joint_friction(f, -0.3, 30.0, 10.0) == Approx(-joint_friction(f, 0.3, 30.0, 10.0)).epsilon(1e-14));
}

TEST_CASE("dry friction is smoothed over its speed: tanh(1) of the level there") {
  JointFriction f;
  f.coulomb = 10.0;
  CHECK(joint_friction(f, friction_smoothing_speed, 0.0, 0.0) == Approx(10.0 * std::tanh(1.0)).epsilon(1e-14));
}

TEST_CASE("a motion in one call has the friction of its instants") {
  const JointFriction f = full_friction();
  const ArrayXd speed = ArrayXd::LinSpaced(201, -0.5, 0.5), torque = ArrayXd::LinSpaced(201, -40.0, 60.0),
                t = ArrayXd::LinSpaced(201, 0.0, 120.0);
  const ArrayXd whole = joint_friction(f, speed, torque, t);
  for (Eigen::Index i = 0; i < speed.size(); ++i)
    CHECK(whole[i] == Approx(joint_friction(f, speed[i], torque[i], t[i])).epsilon(1e-13).margin(1e-13));
}

TEST_CASE("the dry and the viscous part of a sliding joint make its whole friction") {
  const JointFriction f = full_friction();
  const double v = 0.4, torque = 12.0, t = 33.0;  // tanh(v / 0.002) is 1 to rounding
  CHECK(dry_friction_at(f, v, torque, t) + viscous_friction_at(f, v, t) ==
        Approx(joint_friction(f, v, torque, t)).epsilon(1e-14));
}

TEST_CASE("only friction that grows with the load asks for the torque through the gear") {
  cell::Cell cell = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  CHECK_FALSE(JointFriction(cell, 1).needs_gear_torque());
  cell::set_effect(cell, "load_friction", "joint2", "coefficient", 0.02);
  CHECK(JointFriction(cell, 1).needs_gear_torque());
  CHECK_FALSE(JointFriction(cell, 0).needs_gear_torque());
}

}  // namespace friction_test
