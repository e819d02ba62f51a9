#include "gap/fitting/start.hpp"

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "gap/fitting/posterior.hpp"
#include "gap/protocol.hpp"
#include "gap/two_shapes.hpp"

/// @file
/// Where a search begins out of reach of the nominal cell.

namespace start_test {

using namespace kr5;
using namespace two_shapes;

namespace {

/// An arm with torque servos, of which effects of each kind of coordinate exist.
cell::Cell servo_cell() {
  cell::Cell out = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  out.servo->joint.clear();
  out.servo->torque.assign(6, {.stiffness = 40.0, .damping = 2.0});
  return out;
}

gap::Hypothesis hypothesis_of(const cell::Cell& cell, const std::string& effect, const std::string& target) {
  for (gap::Hypothesis& h : gap::hypotheses(cell, {}))
    if (h.effect == effect && h.target == target) return std::move(h);
  throw InvalidArgument("no such effect");
}

/// Adds exp(x) - 1 times a shape, about as an effect whose size is far from its slope.
gap::Hypothesis growing(const std::string& effect, const std::string& column, const Shape& shape) {
  gap::OwnEffect own{{effect, column}, {{"size", "A", 1.0, -20.0, 20.0, {}}}, {}, {}};
  own.change = [column, shape](io::Table& table, const cell::Experiment& e, const Eigen::VectorXd& x) {
    if (const int at = table.find(column); e.kind == cell::Kind::Motion && at >= 0)
      table.values.col(at) += std::expm1(x(0)) * at_times(e, shape);
  };
  return gap::own_hypothesis(own);
}

}  // namespace

TEST_CASE("the coordinate of an effect is found from its value, in every kind of coordinate") {
  const cell::Cell cell = servo_cell();
  struct Case {
    const char* effect;
    const char* target;
    const char* parameter;
    std::vector<double> values;
  };
  const Case cases[] = {{"tool_damping", "servo", "damping_ratio", {0.3, 1.7}},  // a ratio
                        {"servo_stiffness", "joint2", "stiffness", {40.0, 0.9, 7000.0}},
                        {"servo_damping", "joint2", "damping", {0.0, 1e-3, 2.0, 30.0}},  // linear, at its bound too
                        {"torque_limit", "joint2", "torque", {0.5, 12.0}},               // a reciprocal
                        {"coulomb_friction", "joint2", "coulomb", {0.0, 3.0, 80.0}}};
  for (const Case& c : cases)
    for (const double value : c.values) {
      INFO(c.effect << " " << value);
      const gap::Hypothesis h = hypothesis_of(cell, c.effect, c.target);
      const std::optional<double> x = gap::coordinate_at(cell, h, value);
      REQUIRE(x);
      cell::Cell moved = cell;
      h.apply(moved, Eigen::VectorXd::Constant(1, *x));
      const auto there = cell::get_effect(moved.effects, c.effect, c.target, c.parameter);
      REQUIRE(there);
      CHECK(std::get<double>(*there) == Approx(value).margin(1e-9));
    }
  CHECK(!gap::coordinate_at(cell, hypothesis_of(cell, "servo_damping", "joint2"), -1.0));
}

TEST_CASE("effects at fitted values are those of the cell that is made with them") {
  const cell::Cell cell = servo_cell();
  const gap::FittedEffect effect{{"servo_stiffness", "joint3"}, {{"stiffness", {90.0}, {1.0}, "N m/rad"}}, true};
  const auto there = cell::get_effect(gap::cell_with(cell, {effect}).effects, "servo_stiffness", "joint3", "stiffness");
  REQUIRE(there);
  CHECK(std::get<double>(*there) == 90.0);
}

TEST_CASE("what does not pay for itself is left out, and what is left is the fit without it") {
  const World world(recorded(8.0, 0.0, 11));
  const gap::Candidate a = acting_in(adding("wave", "i1", wave), {0, 1}),
                       b = acting_in(adding("ramp", "i1", ramp), {0, 1});
  const gap::NuisanceModel none;
  const gap::FitProblem problem{world.data, none, {}, -3.0, gap::Slopes::WhereNeeded};
  const gap::Model empty = gap::empty_model(problem, world.base);
  const gap::Model both = gap::fit(problem, empty, {part(a, 0.0), part(b, 0.0)});
  const gap::Model alone = gap::fit(problem, empty, {part(a, 0.0)});
  const gap::Model reduced = gap::without_idle(problem, world.base, both, 1);
  CHECK(gap::same_effects(reduced.parts, alone.parts));
  CHECK(reduced.parts[0].x(0) == Approx(alone.parts[0].x(0)).margin(0.02));
  CHECK(reduced.log_evidence == Approx(alone.log_evidence).margin(0.05));

  const gap::Model linear = gap::linear_without(problem, both, 1);  // exact, where effects are linear
  CHECK(linear.chi2_fit == Approx(alone.chi2_fit).margin(0.05));
  CHECK(linear.log_evidence == Approx(alone.log_evidence).margin(0.05));
  const gap::Model without_wave = gap::linear_without(problem, both, 0);
  CHECK(without_wave.log_evidence < both.log_evidence - 10.0);
}

TEST_CASE("a start is within reach where slopes tell the nominal cell, and not where an effect bends") {
  const World world(recorded(300.0, 0.0, 12));
  const gap::NuisanceModel none;
  const gap::FitProblem problem{world.data, none, {}, 0.0, gap::Slopes::WhereNeeded};
  const gap::Model empty = gap::empty_model(problem, world.base);
  const gap::Candidate straight = acting_in(adding("wave", "i1", wave), {0, 1}),
                       bent = acting_in(growing("wave", "i1", wave), {0, 1});
  CHECK(gap::in_reach(world.data, gap::fit(problem, empty, {part(straight, 200.0)}), world.base));
  CHECK(!gap::in_reach(world.data, gap::fit(problem, empty, {part(bent, 5.0)}), world.base));
}

TEST_CASE("a start is refitted on the candidates that are there") {
  const cell::Cell broken = protocol::carrying("coulomb_friction", "joint3", "coulomb", 60.0);
  Random random(13);
  const cell::Recording recording = protocol::only(protocol::record(broken, random), cell::Kind::Motion);
  const predict::FastSimulator simulator;
  gap::ComparisonData data = gap::compare_columns(recording, simulator);
  const Eigen::VectorXd base = gap::compare_nominal(data);
  std::vector<int> all;
  for (std::size_t e = 0; e < data.blocks_of.size(); ++e) all.push_back(static_cast<int>(e));
  const auto friction = std::make_shared<const gap::Candidate>(
      acting_in(hypothesis_of(recording.cell, "coulomb_friction", "joint3"), all));
  const gap::NuisanceModel none;
  const gap::FitProblem problem{data, none, {}, 0.0, gap::Slopes::WhereNeeded};
  const gap::FittedEffect near{{"coulomb_friction", "joint3"}, {{"coulomb", {50.0}, {5.0}, "N m"}}, true},
      absent{{"viscous_friction", "joint3"}, {{"viscous", {50.0}, {5.0}, "N m s/rad"}}, true};
  const gap::Model start = gap::fit_start(problem, base, {near, absent}, {friction}, 2);
  REQUIRE(start.parts.size() == 1);
  const std::vector<gap::ParameterEstimate> found = gap::parameters(data, start, 0, 1.0);
  CHECK(found.front().value[0] == Approx(60.0).epsilon(0.05));
}

}  // namespace start_test
