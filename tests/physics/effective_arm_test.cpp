// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/effective_arm.hpp>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/physics/joint_drive.hpp>
#include <kr5/physics/tool.hpp>

namespace effective_arm_test {

using namespace kr5;
using Eigen::VectorXd;
using physics::EffectiveArm;

namespace {

cell::Cell arc() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

cell::Cell arc_with(const char* effect, const char* target,
                    const std::vector<std::pair<std::string, cell::EffectValue>>& parameters) {
  cell::Cell cell = arc();
  for (const auto& [name, value] : parameters) cell::set_effect(cell, effect, target, name, value);
  return cell;
}

const VectorXd posture = (VectorXd(6) << 0.2, 0.1, -2.7, 0.3, -0.4, 1.2).finished();

}  // namespace

TEST_CASE("an arm without effects is the nominal one") {
  const cell::Cell cell = arc();
  CHECK(EffectiveArm(cell).chain(1000.0).flange(posture).matrix() ==
        cell::nominal_chain(cell).flange(posture).matrix());
}

TEST_CASE("a tilted base turns the arm about the base, and not gravity") {
  const cell::Cell cell = arc_with("base_tilt", "base", {{"roll", 0.02}, {"pitch", -0.03}});
  const Eigen::Matrix3d tilt =
      (Eigen::AngleAxisd(-0.03, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  const Pose nominal = cell::nominal_chain(cell).flange(posture),
             tilted = EffectiveArm(cell).chain(0.0).flange(posture);
  CHECK((tilted.translation() - tilt * nominal.translation()).norm() < 1e-12);
  CHECK((tilted.linear() - tilt * nominal.linear()).norm() < 1e-12);
}

TEST_CASE("links that have grown by a share have moved the flange by that share of the way to it") {
  const cell::Cell cell = arc_with("thermal_growth", "links", {{"growth", 2e-3}, {"time_constant", 100.0}});
  CHECK(physics::thermal_growth(cell, 100.0 * std::log(2.0)) == Approx(1.001).epsilon(1e-14));
  const Eigen::Vector3d nominal = cell::nominal_chain(cell).flange(posture).translation();
  const Eigen::Vector3d grown = EffectiveArm(cell).chain(1e9).flange(posture).translation();
  CHECK((grown - 1.002 * nominal).norm() < 1e-12);
}

TEST_CASE("the mass of a link scales what its joint holds by that link alone, as its inertia") {
  // The last link, in rest and in acceleration about its own axis; the tool is taken off.
  cell::Cell bare = arc();
  bare.tool.reset();
  cell::Cell heavy = bare, light = bare;
  const double mass = bare.robot.links[5].mass;
  cell::set_effect(heavy, "link_mass", "joint6", "mass", 3.0 * mass);
  cell::set_effect(light, "link_mass", "joint6", "mass", 0.0);
  const VectorXd v = VectorXd::LinSpaced(6, -1.0, 2.0), a = VectorXd::LinSpaced(6, 3.0, -4.0);
  const auto torque = [&](const cell::Cell& c) {
    kinematics::Dynamics arm = EffectiveArm(c).dynamics(0.0);
    return VectorXd(arm.loads(posture.transpose(), v.transpose(), a.transpose()).tau.row(0).transpose());
  };
  const VectorXd without = torque(light), with = torque(bare), thrice = torque(heavy);
  CHECK((with - without).norm() > 0.01);
  CHECK((thrice - without - 3.0 * (with - without)).norm() < 1e-10 * with.norm());
}

TEST_CASE("a centre of mass elsewhere adds the moment of the weight at that place") {
  cell::Cell bare = arc();
  bare.tool.reset();
  const VectorXd at_axis = VectorXd::Zero(3), aside = Eigen::Vector3d(0.05, -0.02, 0.03);
  cell::Cell centred = bare, shifted = bare;
  cell::set_effect(centred, "link_com", "joint6", "com", at_axis);
  cell::set_effect(shifted, "link_com", "joint6", "com", aside);
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Zero(1, 6);
  const auto torque = [&](const cell::Cell& c) {
    return EffectiveArm(c).dynamics(0.0).loads(posture.transpose(), rest, rest).tau(0, 5);
  };
  // About the axis of joint 6, in the frame before it: the weight times its lever.
  const kinematics::DhChain chain = EffectiveArm(bare).chain(0.0);
  const std::vector<Pose> frames = chain.link_poses(posture);
  const Eigen::Vector3d axis = frames[frames.size() - 2].linear().col(2),
                        lever = frames.back().linear() * Eigen::Vector3d(aside),
                        weight = bare.robot.links[5].mass * bare.robot.gravity;
  CHECK(torque(shifted) - torque(centred) == Approx(-axis.dot(lever.cross(weight))).epsilon(1e-9));
}

TEST_CASE("a payload adds its weight and its moment to those of the tool") {
  Eigen::VectorXd com(3);
  com << 0.02, -0.01, 0.1;
  const cell::Cell cell = arc_with("payload", "tool", {{"mass", 0.4}, {"com", com}});
  const double g = cell.robot.gravity.norm(), m = cell.tool->mass;
  const Eigen::MatrixXd weight = physics::tool_weight(cell, 2);
  CHECK(weight(1, 2) == Approx((m + 0.4) * g).epsilon(1e-12));
  CHECK(weight(1, 3) == Approx((m * cell.tool->com.y() - 0.4 * 0.01) * g).margin(1e-12));
  CHECK(weight(1, 4) == Approx(-(m * cell.tool->com.x() + 0.4 * 0.02) * g).margin(1e-12));
}

TEST_CASE("a payload that lifts is refused, and the field is named") {
  CHECK_NOTHROW(physics::check_payload(arc_with("payload", "tool", {{"mass", 0.4}})));
  CHECK_THROWS_WITH(physics::check_payload(arc_with("payload", "tool", {{"mass", -0.1}})),
                    Catch::StartsWith("effects.payload.tool.mass: must not be negative"));
}

TEST_CASE("with the tool down the sensor's X is that of the base, and its Y and Z are turned about") {
  const Eigen::Vector3d in_sensor = Eigen::RowVector3d(1, 2, 3) * physics::R_base_sensor_down();
  CHECK(in_sensor == Eigen::Vector3d(1, -2, -3));
  CHECK(physics::R_base_sensor_down().determinant() == 1.0);
}

TEST_CASE("at rest a soft joint sags by its load over its stiffness, and the others stand where they are read") {
  cell::Cell cell = arc_with("joint_elasticity", "joint3", {{"stiffness", 2e4}});
  cell::set_effect(cell, "encoder_offset", "joint1", "offset", 0.01);
  const auto joints = physics::joint_drives(cell);
  kinematics::Dynamics dynamics = EffectiveArm(cell).dynamics(0.0);
  const VectorXd links = physics::links_at_rest(joints, posture, physics::RestRule::Static,
                                                [&](const VectorXd& q) { return dynamics.gravity_torques(q); });
  CHECK(links[0] == posture[0] + 0.01);
  CHECK(links.tail(3) == posture.tail(3));
  CHECK(links[2] == Approx(posture[2] - dynamics.gravity_torques(links)[2] / 2e4).epsilon(1e-9));
  CHECK(std::abs(links[2] - posture[2]) > 1e-4);
}

TEST_CASE("the slope and curvature of a transmission are the derivatives of its link value") {
  physics::Transmission t;
  t.encoder_offset = 0.1, t.amplitude = 2e-3, t.cycles = 7.0, t.phase = 0.3;
  const double q = 0.4, h = 1e-4;
  CHECK(t.slope(q) == Approx((t.link(q + h) - t.link(q - h)) / (2 * h)).epsilon(1e-8));
  CHECK(t.curvature(q) == Approx((t.slope(q + h) - t.slope(q - h)) / (2 * h)).epsilon(1e-5));
}

}  // namespace effective_arm_test
