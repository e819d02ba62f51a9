// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/contact.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/physics/scanner.hpp>
#include <kr5/physics/tube.hpp>

namespace contact_test {

using namespace kr5;

namespace {

cell::Cell arc() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

}  // namespace

TEST_CASE("the depth of a contact is the one at which it gives the force, hard, soft and in a grip") {
  for (const double hardening : {-0.1, 0.0, 0.5}) {
    cell::Cell cell = arc();
    cell::set_effect(cell, "contact_hardening", "contact", "hardening", hardening);
    cell::set_effect(cell, "gripper_compliance", "gripper", "axial", 2e-5);
    const physics::EffectiveContact contact(cell);
    CHECK(contact.force(contact.depth(12.0), 0.0) == Approx(12.0).epsilon(1e-12));
    CHECK(contact.force(-1e-4, 0.1) == 0.0);
  }
}

TEST_CASE("contact and grip give way one after the other") {
  cell::Cell cell = arc();
  const double alone = physics::EffectiveContact(cell).depth(10.0);
  cell::set_effect(cell, "gripper_compliance", "gripper", "axial", 2e-5);
  CHECK(physics::EffectiveContact(cell).depth(10.0) == Approx(alone + 2e-4).epsilon(1e-12));
}

TEST_CASE("friction on a rolled peg is the coefficient times the held force, across its lean") {
  const cell::Cell cell = arc();
  const physics::EffectiveContact contact(cell);
  for (const double alpha : {0.0, 1.0, 4.0}) {
    const Eigen::Vector3d friction = contact.rolling_friction(alpha, 10.0);
    CHECK(friction.norm() == Approx(10.0 * cell.contact->friction).epsilon(1e-12));
    CHECK(friction.dot(Eigen::Vector3d(std::cos(alpha), std::sin(alpha), 0.0)) == Approx(0.0).margin(1e-12));
  }
}

TEST_CASE("a tube is shifted along the believed axes and tilted about X, then Y") {
  cell::Cell cell = arc();
  cell.effects.set("tube_shift", "tube", "shift", Eigen::VectorXd(Eigen::Vector3d(1e-3, 2e-3, 3e-3)));
  cell.effects.set("tube_tilt", "tube", "tilt", Eigen::VectorXd(Eigen::Vector2d(0.1, 0.2)));
  const Pose T = physics::T_tube_actual(cell);
  CHECK(T.translation() == Eigen::Vector3d(1e-3, 2e-3, 3e-3));
  const Eigen::Vector3d axis(std::sin(0.2), -std::sin(0.1) * std::cos(0.2), std::cos(0.1) * std::cos(0.2));
  CHECK((T.linear().col(2) - axis).norm() < 1e-12);
}

TEST_CASE("the bias of a scanner is none at its stand-off and as stated at the distance of the cell") {
  cell::Cell cell = arc();
  cell.effects.set("laser_bias", "laser", "bias", 2e-4);
  const physics::EffectiveScanner as_format(cell);
  CHECK(as_format.laser_bias(0.19) == Approx(0.19).epsilon(1e-14));
  CHECK(as_format.laser_bias(0.24) == Approx(0.24 + 2e-4).epsilon(1e-14));
  cell.laser->stand_off = 0.4;
  cell.laser->bias_distance = 0.1;
  const physics::EffectiveScanner other(cell);
  CHECK(other.laser_bias(0.4) == Approx(0.4).epsilon(1e-14));
  CHECK(other.laser_bias(0.2) == Approx(0.2 + 8e-4).epsilon(1e-14));
}

TEST_CASE("a late scanner shows the profile of where it was") {
  cell::Cell cell = arc();
  cell.effects.set("laser_lag", "laser", "lag", 0.02);
  const Ray ray = physics::EffectiveScanner(cell).laser_lag(Pose::Identity(), 0.01, 0.5);
  CHECK((ray.origin - Eigen::Vector3d(0.01, -0.01, 0.0)).norm() < 1e-15);
  CHECK(ray.direction == Eigen::Vector3d(0, 0, 1));
}

}  // namespace contact_test
