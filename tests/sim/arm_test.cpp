// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/kinematics/newton_euler.hpp>
#include <kr5/sim/arm.hpp>

namespace arm_test {

using namespace kr5;
using sim::Actuation;
using sim::Arm;

namespace {

cell::Cell load(const std::string& name) {
  cell::Cell cell = cell::load_cell(KR5_SHARE_DIR "/cells/" + name + ".yaml");
  cell.effects = {};
  return cell;
}

kinematics::Dynamics newton_euler(const cell::Cell& cell) {
  kinematics::Dynamics out(cell::nominal_chain(cell), cell.robot.links, cell.robot.gravity);
  out.add_body(cell.robot.joints() - 1, {cell.tool->mass, cell.tool->com, cell.tool->inertia},
               cell.tool->T_flange_sensor);
  return out;
}

/// Energy gained in 10 s of free swing, over the largest kinetic energy, by the explicit midpoint rule.
double swing_drift(const cell::Cell& cell, double step) {
  Arm arm(cell);
  const Eigen::Index n = arm.joints();
  for (int i = 0; i < n; ++i) arm.set_actuation(i, Actuation::Free);
  Eigen::VectorXd q = Eigen::VectorXd::LinSpaced(n, 0.4, -0.4), v = Eigen::VectorXd::Zero(n);
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(n);
  arm.set_state(q, v);
  const double start = arm.energy();
  double kinetic = 0.0, drift = 0.0;
  for (int k = 0; k < std::lround(10.0 / step); ++k) {
    arm.set_state(q, v);
    const Eigen::VectorXd middle = v + 0.5 * step * arm.solve(none).acceleration;
    arm.set_state(q + 0.5 * step * v, middle);
    v += step * arm.solve(none).acceleration;
    q += step * middle;
    kinetic = std::max(kinetic, 0.5 * middle.dot(arm.mass_matrix() * middle));
    arm.set_state(q, v);
    drift = std::max(drift, std::abs(arm.energy() - start));
  }
  return drift / kinetic;
}

std::string complaint(const cell::Cell& cell) {
  try {
    const Arm arm(cell);
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST_CASE("forward and inverse dynamics of any arm agree with Newton-Euler, and so does the wrist wrench") {
  for (const char* name : {"kr5_arc", "gantry_rrp"}) {
    const cell::Cell cell = load(name);
    kinematics::Dynamics reference = newton_euler(cell);
    Arm arm(cell);
    const Eigen::Index n = arm.joints();
    const kinematics::SensorCut cut{
        -1, cell.tool->T_flange_sensor, {cell.tool->mass, cell.tool->com, cell.tool->inertia}};
    Random random(4);
    for (int trial = 0; trial < 100; ++trial) {
      const Eigen::VectorXd q = random.normal_vector(n), v = random.normal_vector(n), a = random.normal_vector(n, 5);
      for (int i = 0; i < n; ++i) arm.set_actuation(i, random.integer(2) ? Actuation::Free : Actuation::Driven);
      arm.set_state(q, v);
      const Eigen::VectorXd torque = reference.torques(q, v, a);
      const Vector6 wrench = -reference.wrench(cut);
      CHECK((arm.inverse_dynamics(a).torque - torque).norm() < 1e-9);
      CHECK((arm.inverse_dynamics(a).wrench - wrench).norm() < 1e-9);
      CHECK((arm.mass_matrix() - reference.mass_matrix(q)).norm() < 1e-9);
      CHECK((arm.bias_torque() - reference.torques(q, v, 0 * v)).norm() < 1e-9);
      CHECK((arm.gravity_torque() - reference.gravity_torques(q)).norm() < 1e-9);
      for (int i = 0; i < n; ++i) arm.set_actuation(i, Actuation::Free);
      CHECK((arm.solve(torque).acceleration - a).norm() < 1e-9 * a.norm());
      CHECK((arm.solve(torque).wrench - wrench).norm() < 1e-9);
      CHECK(arm.T_base_flange().isApprox(cell::nominal_chain(cell).flange(q), 1e-12));
    }
  }
}

TEST_CASE("an arm partly driven and partly free gives the torques of the driven and the motion of the free joints") {
  const cell::Cell cell = load("kr5_arc");
  kinematics::Dynamics reference = newton_euler(cell);
  Arm arm(cell);
  Random random(5);
  const Eigen::VectorXd q = random.normal_vector(6), v = random.normal_vector(6), a = random.normal_vector(6, 5);
  const Eigen::VectorXd torque = reference.torques(q, v, a);
  Eigen::VectorXd command = a;
  for (const int i : {1, 4}) {
    arm.set_actuation(i, Actuation::Free);
    command[i] = torque[i];
  }
  arm.set_state(q, v);
  const sim::ArmForces& forces = arm.solve(command);
  CHECK((forces.acceleration - a).norm() < 1e-9);
  CHECK((forces.torque - torque).norm() < 1e-9);
}

TEST_CASE("a force on the tool shows in the wrench and in the torques that hold it") {
  const cell::Cell cell = load("kr5_arc");
  Arm arm(cell);
  const Eigen::VectorXd q = Eigen::VectorXd::LinSpaced(6, 0.5, -1.5), none = Eigen::VectorXd::Zero(6);
  arm.set_state(q);
  const Vector6 still = arm.inverse_dynamics(none).wrench;
  const Eigen::VectorXd held = arm.inverse_dynamics(none).torque;
  Vector6 push;
  push << 10, -20, 30, 1, 2, -3;
  arm.set_contact(push);
  const Eigen::Matrix3d R = arm.T_base_sensor().linear();
  Vector6 expected = still;
  expected.head<3>() += R.transpose() * push.head<3>();
  expected.tail<3>() += R.transpose() * push.tail<3>();
  CHECK((arm.inverse_dynamics(none).wrench - expected).norm() < 1e-9);
  CHECK((arm.bias_torque() - arm.inverse_dynamics(none).torque).norm() < 1e-9);
  Eigen::VectorXd step = none;  // virtual work: the torques lose what the push gains
  const double h = 1e-6;
  for (int i = 0; i < 6; ++i) {
    step = none;
    step[i] = 1.0;
    arm.set_state(q, step);
    const double work = push.dot(arm.sensor_velocity());
    arm.set_state(q);
    CHECK(arm.inverse_dynamics(none).torque[i] == Approx(held[i] - work).margin(1e-9));
  }
  arm.set_state(q + h * step);
  CHECK(arm.T_base_sensor().linear().isApprox(R, 1e-5));
}

TEST_CASE("a free swing keeps its energy to 0.5 % over 10 s at 1 ms, the better the smaller the step") {
  const cell::Cell cell = load("kr5_arc");
  const double coarse = swing_drift(cell, 2e-3), fine = swing_drift(cell, 1e-3);
  CHECK(fine < 0.005);
  CHECK(fine < 0.5 * coarse);
}

TEST_CASE("geometry, growth, base tilt and payload of the effects change the arm") {
  const cell::Cell nominal = load("kr5_arc");
  const Eigen::VectorXd q = Eigen::VectorXd::LinSpaced(6, 0.5, -1.5), none = Eigen::VectorXd::Zero(6);
  SECTION("lengths, twists and growth") {
    cell::Cell cell = nominal;
    cell::set_effect(cell, "link_length", "joint2", "a", 0.61);
    cell::set_effect(cell, "link_twist", "joint3", "alpha", 1.5);
    cell::set_effect(cell, "thermal_growth", "links", "growth", 1e-3);
    cell::set_effect(cell, "thermal_growth", "links", "time_constant", 100.0);
    cell::Cell grown = nominal;
    grown.robot.dh[1].a = 0.61;
    grown.robot.dh[2].alpha = 1.5;
    for (auto& row : grown.robot.dh) {
      row.a *= 1 + 1e-3 * (1 - std::exp(-2.0));
      row.b *= 1 + 1e-3 * (1 - std::exp(-2.0));
    }
    Arm arm(cell);
    arm.set_state(q);
    arm.set_clock(200.0);
    CHECK(arm.T_base_flange().isApprox(cell::nominal_chain(grown).flange(q), 1e-12));
  }
  SECTION("base tilt turns the robot in B, where gravity stays") {
    cell::Cell cell = nominal;
    cell::set_effect(cell, "base_tilt", "base", "roll", 0.02);
    cell::set_effect(cell, "base_tilt", "base", "pitch", -0.03);
    const Eigen::Matrix3d R =
        (Eigen::AngleAxisd(-0.03, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    cell::Cell turned = nominal;
    turned.robot.gravity = R.transpose() * nominal.robot.gravity;
    Arm arm(cell), other(turned);
    arm.set_state(q);
    other.set_state(q);
    CHECK((arm.T_base_flange().translation() - R * other.T_base_flange().translation()).norm() < 1e-12);
    CHECK((arm.inverse_dynamics(none).torque - other.inverse_dynamics(none).torque).norm() < 1e-9);
  }
  SECTION("a payload hangs on the sensor") {
    cell::Cell cell = nominal;
    cell::set_effect(cell, "payload", "tool", "mass", 0.5);
    cell::set_effect(cell, "payload", "tool", "com", Eigen::VectorXd(Eigen::Vector3d(0.02, 0.01, 0.1)));
    Arm with(cell), without(nominal);
    with.set_state(q);
    without.set_state(q);
    const Eigen::Vector3d weight = with.T_base_sensor().linear().transpose() * (0.5 * nominal.robot.gravity);
    const Vector6 more = with.inverse_dynamics(none).wrench - without.inverse_dynamics(none).wrench;
    CHECK((more.head<3>() - weight).norm() < 1e-9);
    CHECK((more.tail<3>() - Eigen::Vector3d(0.02, 0.01, 0.1).cross(weight)).norm() < 1e-9);
  }
}

TEST_CASE("masses and inertias that no body has are refused by field") {
  const cell::Cell good = load("kr5_arc");
  CHECK(complaint(good).empty());
  cell::Cell cell = good;
  cell.robot.links[2].mass = -1.0;
  CHECK_THAT(complaint(cell), Catch::StartsWith("robot.links[2].mass: must be positive, found -1"));
  cell = good;
  cell.robot.links[4].inertia[1] = 0.0;
  CHECK_THAT(complaint(cell), Catch::StartsWith("robot.links[4].inertia: every principal moment must be positive"));
  cell = good;
  cell.tool->inertia[2] = -0.1;
  CHECK_THAT(complaint(cell), Catch::StartsWith("tool.inertia: every principal moment must not be negative"));
  cell = good;
  cell.robot.links.pop_back();
  CHECK_THAT(complaint(cell), Catch::StartsWith("robot.links: found 5, expected one a joint: 6"));
  cell = good;
  cell.robot.links.clear();
  Arm bare(cell);
  bare.set_state(Eigen::VectorXd::Zero(6));
  CHECK(bare.T_base_flange().isApprox(cell::nominal_chain(good).flange(Eigen::VectorXd::Zero(6)), 1e-12));
  CHECK_THROWS_WITH(bare.mass_matrix(), Catch::StartsWith("robot.links: this cell has no masses"));
}

TEST_CASE("a state of the wrong size or without numbers is refused") {
  Arm arm(load("kr5_arc"));
  CHECK_THROWS_AS(arm.set_state(Eigen::VectorXd::Zero(5)), InvalidArgument);
  CHECK_THROWS_AS(arm.set_state(Eigen::VectorXd::Constant(6, NAN)), InvalidArgument);
  CHECK_THROWS_AS(arm.set_actuation(6, Actuation::Free), InvalidArgument);
}

TEST_CASE("numbers that no arm has are refused by field, and never reach the assertions of DART") {
  const auto expect = [](const char* field, auto&& change) {
    for (const double odd : {std::numeric_limits<double>::infinity(), std::nan(""), 1e308}) {
      cell::Cell cell = load("kr5_arc");
      change(cell, odd);
      CAPTURE(field, odd);
      CHECK_THAT(complaint(cell), Catch::StartsWith(field));
    }
  };
  expect("robot.links[2].mass", [](cell::Cell& c, double x) { c.robot.links[2].mass = x; });
  expect("robot.links[2].com", [](cell::Cell& c, double x) { c.robot.links[2].com.y() = x; });
  expect("robot.gravity", [](cell::Cell& c, double x) { c.robot.gravity.z() = x; });
  expect("robot.dh[1]", [](cell::Cell& c, double x) { c.robot.dh[1].a = x; });
  expect("robot.dh[3]", [](cell::Cell& c, double x) { c.robot.dh[3].alpha = x; });
  expect("tool", [](cell::Cell& c, double x) { c.tool->mass = x; });
  expect("tool", [](cell::Cell& c, double x) { c.tool->com.x() = x; });
}

TEST_CASE("a motion that has run away is refused before it is simulated") {
  Arm arm(load("kr5_arc"));
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(6);
  CHECK_THROWS_WITH(arm.set_state(zero, Eigen::VectorXd::Constant(6, 1e200)), Catch::Contains("has diverged"));
  CHECK_THROWS_AS(arm.set_contact(Vector6::Constant(std::nan(""))), InvalidArgument);
  arm.set_state(zero);
  CHECK_THROWS_AS(arm.solve(Eigen::VectorXd::Constant(6, std::nan(""))), InvalidArgument);
  CHECK_THROWS_AS(arm.inverse_dynamics(Eigen::VectorXd::Constant(6, 1e300)), InvalidArgument);
}

}  // namespace arm_test
