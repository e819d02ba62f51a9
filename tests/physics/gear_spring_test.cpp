// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/gear_spring.hpp>
#include <kr5/physics/identified_cell.hpp>

#include <cmath>

#include <catch2/catch.hpp>

namespace gear_spring_test {

using namespace kr5;
using physics::GearSpring;

namespace {

cell::Cell arc() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

}  // namespace

TEST_CASE("a gear without effect is rigid") {
  const GearSpring gear = physics::gear_spring(arc(), 1);
  CHECK(gear.rigid());
  CHECK(gear.lead_in_balance(100.0) == 0.0);
  CHECK(gear.lead_at_rest(100.0) == 0.0);
}

TEST_CASE("a spring with play is stretched by what goes beyond the play") {
  const GearSpring gear = {1000.0, 0.02, 0.0, 0.5, true};
  CHECK(gear.strain(0.005) == 0.0);
  CHECK(gear.strain(0.015) == Approx(0.005).epsilon(1e-12));
  CHECK(gear.strain(-0.015) == Approx(-0.005).epsilon(1e-12));
  CHECK(gear.torque(0.03, 0.0, 1.0) == Approx(20.0).epsilon(1e-12));
  CHECK(gear.touching_side(0.011) == 1.0);
  CHECK(gear.touching_side(-0.011) == -1.0);
  CHECK(gear.touching_side(0.001) == 0.0);
}

TEST_CASE("in balance the spring holds its torque, on the side to which the torque pushes") {
  const GearSpring gear = {1000.0, 0.02, 0.1, 0.5, true};
  for (const double torque : {-40.0, -0.01, 0.01, 0.3, 40.0})
    CHECK(gear.torque(gear.lead_in_balance(torque), 0.0, 2.0) == Approx(torque).epsilon(1e-9));
  CHECK(gear.lead_in_balance(0.0) == 0.0);
}

TEST_CASE("a static posture takes a side only beyond the side torque, and a gear behind a play does not sag") {
  GearSpring gear = {1000.0, 0.02, 0.1, 0.5, true};
  CHECK(gear.lead_at_rest(0.4) == Approx(0.0004).epsilon(1e-12));
  CHECK(gear.lead_at_rest(2.0) == Approx(0.012).epsilon(1e-12));
  gear.sags = false;
  CHECK(gear.lead_at_rest(0.4) == 0.0);
  CHECK(gear.lead_at_rest(-2.0) == Approx(-0.01).epsilon(1e-12));
}

TEST_CASE("the damper of a gear has its ratio of the critical damping of link and spring") {
  // Two periods of a link on the spring, by small steps: the amplitude falls as exp(-2 pi n zeta / sqrt(1 - zeta^2)).
  const double K = 5000.0, M = 3.0, zeta = 0.06, w = std::sqrt(K / M), damped = w * std::sqrt(1 - zeta * zeta);
  const GearSpring gear = {K, 0.0, zeta, 0.5, true};
  double x = 1e-3, v = 0.0;
  const int steps = 400000;
  const double h = 2 * 2 * M_PI / damped / steps;
  for (int i = 0; i < steps; ++i) {
    v += h * gear.torque(-x, -v, M) / M;
    x += h * v;
  }
  CHECK(x / 1e-3 == Approx(std::exp(-4 * M_PI * zeta / std::sqrt(1 - zeta * zeta))).epsilon(1e-4));
}

TEST_CASE("numbers of the gears come from the cell, the last stiffness for all further joints") {
  cell::Cell cell = arc();
  cell.robot.gears = {{2e5, 1e5}, 0.05, 0.2, 1.5};
  cell.effects.set("backlash", "joint1", "gap", 1e-3);
  cell.effects.set("backlash", "joint5", "gap", 2e-3);
  cell.effects.set("joint_elasticity", "joint6", "stiffness", 700.0);
  const GearSpring first = physics::gear_spring(cell, 0), fifth = physics::gear_spring(cell, 4),
                   last = physics::gear_spring(cell, 5);
  CHECK(first.stiffness == 2e5);
  CHECK(first.damping_ratio == 0.2);
  CHECK(first.side_torque == 1.5);
  CHECK_FALSE(first.sags);
  CHECK(fifth.stiffness == 1e5);
  CHECK(fifth.gap == 2e-3);
  CHECK(last.stiffness == 700.0);
  CHECK(last.damping_ratio == 0.05);
  CHECK(last.sags);
}

TEST_CASE("gears are fields of a cell file, and a file without them has those of the format") {
  const cell::Cell plain = arc();
  CHECK(plain.robot.gears == cell::Gears{});
  cell::Cell cell = plain;
  cell.robot.gears.stiffness = {4e5};
  cell.robot.gears.side_torque = 0.25;
  const cell::Cell again = cell::parse_cell(cell::to_yaml(cell), "written");
  CHECK(again.robot.gears == cell.robot.gears);
}

TEST_CASE("a gear that stays on its side is a linear spring there") {
  const physics::GearSpring gear{500.0, 0.02, 0.1, 0.0, true};
  for (const double lead : {-0.03, -0.01, 0.0, 0.004, 0.01, 0.05}) {
    const double side = gear.touching_side(lead);
    CHECK(gear.strain_on(side, lead) == gear.strain(lead));
    CHECK(gear.stiffness_on(side) == (std::abs(lead) >= 0.01 ? 500.0 : 0.0));
  }
  CHECK(gear.strain(0.05) == Approx(0.04).epsilon(1e-14));
  CHECK(gear.strain(-0.05) == Approx(-0.04).epsilon(1e-14));
}

TEST_CASE("an identified spring in a cell is the gear of its joint") {
  cell::Cell cell = arc();
  physics::set_joint_spring(cell, 2, 3e4, 5e-4);
  physics::set_joint_spring(cell, 4, 6e4, 0.0);
  const cell::Cell again = cell::parse_cell(cell::to_yaml(cell), "written");
  CHECK(physics::gear_spring(again, 2).lead_in_balance(-60.0) == Approx(-60.0 / 3e4 - 2.5e-4).epsilon(1e-12));
  CHECK(physics::gear_spring(again, 4).lead_in_balance(60.0) == Approx(1e-3).epsilon(1e-12));
  CHECK(physics::gear_spring(again, 3).rigid());
  CHECK_THROWS_WITH(physics::set_joint_spring(cell, 6, 1e4, 0.0), Catch::Contains("joint: found 6, expected 0 to 5"));
}

}  // namespace gear_spring_test
