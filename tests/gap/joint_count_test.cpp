// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/random.hpp>
#include <kr5/gap/diagnose.hpp>
#include <kr5/gap/plan.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "gap/diagnosis_matchers.hpp"
#include "gap/protocol.hpp"
#include "support/arm_cells.hpp"

namespace joint_count_test {

using namespace kr5;

namespace {

const test::ArmCase seven_joints{"rrrrrrr"};

/// Sums of two sines in every joint, at rest in the beginning.
cell::Experiment motion_of(const std::string& name, cell::Split split, int count, double speed, Random& random) {
  cell::Experiment out{name, cell::Kind::Motion, name + ".csv", split, {{"t"}, {}}};
  const int n = seven_joints.size();
  out.data.values.resize(count, n + 1);
  for (int i = 0; i < count; ++i) out.data.values(i, 0) = 0.008 * i;
  for (int j = 0; j < n; ++j) {
    out.data.columns.push_back("qc" + std::to_string(j + 1));
    const double rate[] = {speed * random.uniform(0.4, 0.8), speed * random.uniform(0.8, 1.6)};
    const double phase = random.uniform(0.0, 6.28);
    for (int i = 0; i < count; ++i) {
      const double t = out.data.values(i, 0), grow = 1 - std::exp(-t * t);
      out.data.values(i, j + 1) = 0.1 * (j % 3) + 0.4 * grow * (std::sin(rate[0] * t) + std::sin(rate[1] * t + phase));
    }
  }
  return out;
}

cell::Recording recorded(const cell::Cell& truth, Random& random) {
  using enum cell::Split;
  cell::Recording out;
  out.cell = test::arm_cell(seven_joints);
  out.experiments = {motion_of("motion-1", Fit, 1000, 2.0, random), motion_of("motion-2", Fit, 1000, 0.5, random),
                     motion_of("motion-3", Check, 800, 1.5, random)};
  for (cell::Experiment& e : out.experiments) protocol::show(e, truth, random);
  return out;
}

cell::Cell seven_with(const char* effect, const char* target, const char* parameter, double value) {
  cell::Cell out = test::arm_cell(seven_joints);
  cell::set_effect(out, effect, target, parameter, value);
  return out;
}

}  // namespace

TEST_CASE("an arm of 7 joints: effects of its last joint and motor are named, and nothing else is", "[not_sanitized]") {
  Random random(71);
  struct Row {
    const char *effect, *target, *parameter;
    double value;
  };
  for (const Row& row :
       {Row{"viscous_friction", "joint7", "viscous", 12.0}, Row{"torque_constant", "joint7", "torque_constant", 0.2},
        Row{"cable_spring", "joint4", "stiffness", 20.0}}) {
    const cell::Recording r = recorded(seven_with(row.effect, row.target, row.parameter, row.value), random);
    const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
    INFO(row.effect << " on " << row.target << ": " << test::text(d));
    CHECK(test::names_only(d, {{row.effect, row.target}}));
  }
  const gap::Diagnosis none = gap::diagnose(recorded(test::arm_cell(seven_joints), random), predict::FastSimulator());
  INFO(test::text(none));
  CHECK(test::names_only(none, {}));
}

TEST_CASE("an arm of 7 joints: a planned experiment moves all of them and tells two frictions apart") {
  Random random(72);
  cell::Recording r = recorded(seven_with("coulomb_friction", "joint7", "coulomb", 6.0), random);
  r.experiments.resize(1);
  r.experiments[0].data.values = Eigen::MatrixXd(r.experiments[0].data.values.topRows(200));
  const std::vector<gap::Alternative> both = {{{"coulomb_friction", "joint7"}}, {{"viscous_friction", "joint7"}}};
  const gap::Plan plan = gap::plan(r, predict::FastSimulator(), both);
  INFO(plan.text);
  REQUIRE_FALSE(plan.experiments.empty());
  CHECK(plan.experiments[0].separation > 5.0);
  cell::Recording next;
  next.cell = r.cell;
  next.experiments = {plan.experiments[0].experiment};
  CHECK(next.experiments[0].data.find("qc7") >= 0);
  protocol::show(next.experiments[0], plan.cells[0], random);
  CHECK(gap::compare_models({r, next}, predict::FastSimulator(), both).best == 0);
  const gap::Diagnosis d = gap::diagnose(next, predict::FastSimulator());
  INFO(test::text(d));
  CHECK(test::names_only(d, {{"coulomb_friction", "joint7"}}));
}

}  // namespace joint_count_test
