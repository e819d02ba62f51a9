// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/sim/driven_arm.hpp>

namespace driven_arm_test {

using namespace kr5;
using sim::DrivenArm;

namespace {

cell::Cell arc() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

cell::Cell frictionless() {
  cell::Cell cell = arc();
  cell.drives->friction.coulomb.setZero();
  cell.drives->friction.viscous.setZero();
  return cell;
}

const Eigen::VectorXd& home() {
  static const Eigen::VectorXd q = (Eigen::VectorXd(6) << 0.2, 0.3, -2.6, 0.4, -0.5, 0.3).finished();
  return q;
}

double swing_drift(double step) {
  DrivenArm arm(frictionless(), {step, {}});
  arm.reset(home());
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(6);
  const double start = arm.energy();
  double drift = 0.0, fastest = 0.0, kinetic = 0.0;
  for (int k = 0; k < std::lround(10.0 / step); ++k) {
    arm.drive(none);
    drift = std::max(drift, std::abs(arm.energy() - start));
    if (k % 100 != 0) continue;
    const Eigen::VectorXd v = arm.read().velocity;
    kinetic = std::max(kinetic, 0.5 * v.dot((arm.arm().mass_matrix() + arm.drives().rotor_matrix()) * v));
    fastest = std::max(fastest, v.cwiseAbs().maxCoeff());
  }
  CHECK(fastest > 1.0);  // it does swing
  return drift / kinetic;
}

}  // namespace

TEST_CASE("motors accelerate links and rotors together, coupled gears included") {
  DrivenArm arm(frictionless(), {1e-6, {}});
  arm.reset(home());
  const Eigen::VectorXd current = (Eigen::VectorXd(6) << 1, -2, 1, 2, -1, 1.5).finished();
  arm.arm().set_state(home());
  const Eigen::MatrixXd H = arm.arm().mass_matrix() + arm.drives().rotor_matrix();
  const cell::Drives drives = arc().drives.value();
  const Eigen::VectorXd torque = drives.structure.transpose() * drives.torque_constant.cwiseProduct(current);
  const Eigen::VectorXd expected = H.llt().solve(torque - arm.arm().gravity_torque());
  arm.drive(current);
  CHECK((arm.read().acceleration - expected).norm() < 1e-6 * expected.norm());
  CHECK((arm.read().velocity - 1e-6 * expected).norm() < 1e-9 * expected.norm());
}

TEST_CASE("a free swing of the whole arm, rotors included, keeps its energy, the better the smaller the step") {
  const double coarse = swing_drift(2e-3), fine = swing_drift(1e-3);
  CHECK(fine < 0.005);
  CHECK(fine < 0.5 * coarse);
}

TEST_CASE("dry friction holds a joint that pulls less than its level, exactly, and lets go beyond") {
  cell::Cell cell = frictionless();
  DrivenArm probe(cell);
  probe.arm().set_state(home());
  const Eigen::VectorXd pull = probe.arm().gravity_torque().cwiseAbs();
  cell.drives->friction.coulomb = 1.001 * pull;
  DrivenArm held(cell);
  held.reset(home());
  for (int k = 0; k < 2000; ++k) held.drive(Eigen::VectorXd::Zero(6));
  CHECK((held.read().position - home()).cwiseAbs().maxCoeff() < 1e-9);
  CHECK((held.read().friction.cwiseAbs() - pull).cwiseAbs().maxCoeff() < 1e-6);
  cell.drives->friction.coulomb[1] = 0.95 * pull[1];
  DrivenArm slipping(cell);
  slipping.reset(home());
  for (int k = 0; k < 200; ++k) slipping.drive(Eigen::VectorXd::Zero(6));
  CHECK(std::abs(slipping.read().position[1] - home()[1]) > 1e-4);
}

TEST_CASE("the ideal servo answers a step as its differential equation says, whatever the step of the integration") {
  const cell::SecondOrder servo = arc().servo->of_joint(0);
  const double w = servo.natural_frequency, d = servo.damping_ratio, s = w * std::sqrt(1 - d * d);
  for (const double step : {1e-3, 2.5e-4}) {
    DrivenArm arm(arc(), {step, {}});
    arm.reset(home());
    const Eigen::VectorXd to = home() + Eigen::VectorXd::Constant(6, 0.1);
    arm.follow(home());
    arm.follow(to);  // the command runs up within one step
    const double passed = 0.06;
    for (int k = 0; k < std::lround(passed / step); ++k) arm.follow(to);
    const double t = passed + 0.5 * step;
    const double expected = 1 - std::exp(-d * w * t) * (std::cos(s * t) + d * w / s * std::sin(s * t));
    CHECK((arm.read().position - home()).maxCoeff() == Approx(0.1 * expected).epsilon(1e-3));
    CHECK(arm.read().position[3] - home()[3] == Approx(0.1 * expected).epsilon(1e-3));
  }
}

TEST_CASE("a servo without current limit holds its command against gravity, within a limit it stalls at the limit") {
  const cell::Cell cell = arc();
  DrivenArm free(cell);
  free.reset(home());
  for (int k = 0; k < 500; ++k) free.follow_limited(home());
  CHECK((free.read().position - home()).norm() < 1e-3);
  CHECK_FALSE(free.read().limited);
  const Eigen::VectorXd limit = Eigen::VectorXd::Constant(6, 12.0);
  DrivenArm pushed(cell, {0.0, limit});
  pushed.reset(home());
  pushed.set_environment([](const Pose&, const Vector6&, double t) {
    Vector6 wrench = Vector6::Zero();
    wrench[0] = t > 0.1 ? 3000.0 : 0.0;  // more than joint 1 can hold
    return wrench;
  });
  double most = 0.0;
  for (int k = 0; k < 300; ++k) {
    pushed.follow_limited(home());
    most = std::max(most, pushed.read().current.cwiseAbs().maxCoeff());
  }
  CHECK(pushed.read().limited);
  CHECK(most == Approx(12.0));
  CHECK((pushed.read().position - home()).cwiseAbs().maxCoeff() > 0.01);
}

TEST_CASE("an elastic joint sags by gravity torque over stiffness and swings at its natural frequency") {
  cell::Cell cell = arc();
  const double stiffness = 2e4;
  cell::set_effect(cell, "joint_elasticity", "joint2", "stiffness", stiffness);
  DrivenArm arm(cell);
  arm.reset(home());
  arm.arm().set_state(arm.read().link);
  const double gravity = arm.arm().gravity_torque()[1];
  CHECK(arm.read().link[1] - home()[1] == Approx(-gravity / stiffness).epsilon(1e-5));
  CHECK(arm.read().position[1] == home()[1]);
  const double inertia = arm.arm().mass_matrix()(1, 1), rest = arm.read().link[1], h = 1e-4;
  arm.arm().set_state(arm.read().link + h * Eigen::VectorXd::Unit(6, 1));
  const double stiff = stiffness + (arm.arm().gravity_torque()[1] - gravity) / h;  // gravity pulls or pushes too
  arm.follow(home() + 1e-3 * Eigen::VectorXd::Unit(6, 1));
  std::vector<double> crossings;
  double before = 0.0;
  for (int k = 0; k < 4000 && crossings.size() < 12; ++k) {
    arm.follow(home());
    const double now = arm.read().link[1] - rest;
    if (before < 0 && now >= 0) crossings.push_back(arm.read().t - arm.step() * now / (now - before));
    before = now;
  }
  REQUIRE(crossings.size() == 12);
  const double period = (crossings.back() - crossings[2]) / 9;
  const double expected = 2 * std::acos(-1.0) / std::sqrt(stiff / inertia * (1 - 0.06 * 0.06));
  CHECK(period == Approx(expected).epsilon(0.002));
}

TEST_CASE("the link lies at the side of its play that gravity chooses, and changes sides when the motor turns round") {
  cell::Cell cell = arc();
  const double gap = 4e-3, teeth = 8e5;
  cell::set_effect(cell, "backlash", "joint2", "gap", gap);
  DrivenArm arm(cell);
  const auto lead = [&] { return arm.read().position[1] - arm.read().link[1]; };
  const auto gravity = [&] {
    arm.arm().set_state(arm.read().link);
    return arm.arm().gravity_torque()[1];
  };
  arm.reset(home());
  CHECK(lead() == Approx(std::copysign(gap / 2, gravity()) + gravity() / teeth).epsilon(1e-5));
  const double before = lead();
  Eigen::VectorXd command = home();
  bool crossed = false;
  for (int k = 0; k < std::lround(0.4 / arm.step()); ++k) {  // thrown down faster than it falls, and caught
    const double t = k * arm.step();
    command[1] = home()[1] - std::copysign(0.4, before) * 0.5 * (1 - std::cos(std::acos(-1.0) * t / 0.2));
    arm.follow(command);
    crossed |= lead() * before < 0 && std::abs(lead()) >= gap / 2;
    CHECK(std::abs(lead()) < gap / 2 + 3e3 / teeth);
  }
  CHECK(crossed);
}

TEST_CASE("a step beyond the stable bound is refused with the bound, one within is stable") {
  cell::Cell cell = arc();
  cell::set_effect(cell, "joint_elasticity", "joint6", "stiffness", 3000.0);
  DrivenArm probe(cell);
  const double bound = probe.stable_step(Eigen::VectorXd::Zero(6));
  CHECK(bound < 5e-3);
  CHECK_THROWS_WITH(DrivenArm(cell, {1.05 * bound, {}}), Catch::Contains("the stable bound here is"));
  DrivenArm arm(cell, {0.95 * bound, {}});
  arm.reset(Eigen::VectorXd::Zero(6));
  const double rest = arm.read().link[5];
  arm.follow(1e-3 * Eigen::VectorXd::Unit(6, 5));
  for (int k = 0; k < 20000; ++k) arm.follow(Eigen::VectorXd::Zero(6));
  CHECK(arm.read().link[5] == Approx(rest).margin(1e-6));
}

TEST_CASE("sizes, signs and parts that are not there are refused by name") {
  CHECK_THROWS_WITH(DrivenArm(arc(), {-1.0, {}}), Catch::StartsWith("step: must not be negative"));
  CHECK_THROWS_WITH(DrivenArm(arc(), {0.0, Eigen::VectorXd::Ones(5)}), Catch::StartsWith("current_limit: found 5"));
  cell::Cell cell = arc();
  cell.drives.reset();
  DrivenArm arm(cell);
  arm.reset(home());
  CHECK_THROWS_WITH(arm.drive(home()), Catch::Contains("need motors"));
  CHECK_NOTHROW(arm.follow(home()));
  CHECK(arm.read().current.size() == 0);
  cell.servo.reset();
  DrivenArm still(cell);
  CHECK_THROWS_WITH(still.follow(home()), Catch::StartsWith("servo.joint"));
  cell = arc();
  cell.drives->structure.row(5).setZero();
  CHECK_THROWS_WITH(DrivenArm(cell), Catch::StartsWith("drives.structure: has no inverse"));
  cell = arc();
  cell.effects.set("stribeck_friction", "joint7", "stribeck", 1.0);
  CHECK_THROWS_WITH(DrivenArm(cell), Catch::Contains("joint7"));
}

}  // namespace driven_arm_test
