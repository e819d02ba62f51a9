// SPDX-License-Identifier: BSD-3-Clause
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/gap/diagnose.hpp>
#include <kr5/gap/effect_fit.hpp>
#include <kr5/gap/measure.hpp>
#include <kr5/gap/plan.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "gap/protocol.hpp"

namespace invalid_cell_test {

using namespace kr5;
using Catch::Contains;

namespace {

cell::Recording sound() {
  Random random(81);
  return protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Step);
}

cell::Cell without_mass() {
  cell::Cell out = protocol::nominal();
  out.tool->mass = 0.0;
  return out;
}

cell::Cell with_nan() {
  cell::Cell out = protocol::nominal();
  out.robot.links[2].mass = std::numeric_limits<double>::quiet_NaN();
  return out;
}

}  // namespace

TEST_CASE("every entry of the diagnosis refuses an invalid cell of a recording and names the field") {
  const predict::FastSimulator simulator;
  const std::vector<gap::Alternative> two = {{{"tool_servo", "servo"}}, {{"tool_damping", "servo"}}};
  cell::Recording wrong = sound();
  for (const auto& [cell, field] :
       {std::pair{without_mass(), "tool.mass"}, std::pair{with_nan(), "robot.links[2].mass"}}) {
    wrong.cell = cell;
    CHECK_THROWS_WITH(gap::diagnose(wrong, simulator), Contains(field));
    CHECK_THROWS_WITH(gap::plan(wrong, simulator, two), Contains(field));
    CHECK_THROWS_WITH(gap::compare_models({sound(), wrong}, simulator, two), Contains(field));
    CHECK_THROWS_WITH(gap::residual_columns(wrong, simulator), Contains(field));
    CHECK_THROWS_AS(gap::diagnose(wrong, simulator), InvalidArgument);
  }
}

TEST_CASE("every entry that is given a cell beside the recording refuses an invalid one and names the field") {
  const predict::FastSimulator simulator;
  const cell::Recording r = sound();
  for (const auto& [cell, field] :
       {std::pair{without_mass(), "tool.mass"}, std::pair{with_nan(), "robot.links[2].mass"}}) {
    CHECK_THROWS_WITH(gap::measure(r, cell, simulator), Contains(field));
    CHECK_THROWS_WITH(gap::fit_effects(r, cell, simulator, {{"tool_servo", "servo"}}), Contains(field));
    CHECK_THROWS_WITH(gap::fit_best_effects(r, cell, simulator, {}, 1), Contains(field));
    CHECK_THROWS_WITH(gap::residual_columns(r, simulator, {r.cell, cell}), Contains(field));
  }
}

}  // namespace invalid_cell_test
