#include <kr5/gap/hypotheses.hpp>

#include <cmath>
#include <functional>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/gap/diagnose.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "gap/protocol.hpp"

namespace hypotheses_test {

using namespace kr5;

namespace {

/// A current sensor whose reading bends: i becomes i + bend i^2. No cell can hold that.
gap::OwnEffect bent_sensor() {
  gap::OwnEffect out{{"bent_sensor", "i2"}, {{"bend", "1/A", 0.01, -0.5, 0.5, {}}}, {}, {}};
  out.change = [](io::Table& table, const cell::Experiment&, const Eigen::VectorXd& x) {
    if (const int at = table.find("i2"); at >= 0)
      table.values.col(at).array() += x(0) * table.values.col(at).array().square();
  };
  return out;
}

/// Gravity other than believed: what a cell can hold and the catalogue lacks.
gap::OwnEffect heavy_world() {
  gap::OwnEffect out{{"heavy_world", "gravity"}, {{"part", "-", 0.01, -0.5, 0.5, {}}}, {}, {}};
  out.apply = [](cell::Cell& c, const Eigen::VectorXd& x) { c.robot.gravity *= 1 + x(0); };
  return out;
}

cell::Recording motions(const cell::Cell& truth, Random& random) {
  cell::Recording r = protocol::record(truth, random);
  std::erase_if(r.experiments, [](const cell::Experiment& e) { return e.kind != cell::Kind::Motion; });
  return r;
}

}  // namespace

TEST_CASE("an own effect that changes columns is found beside the catalogue, with its size in its own unit") {
  Random random(21);
  cell::Recording r = motions(protocol::nominal(), random);
  constexpr double bend = 0.03;
  protocol::change(r, cell::Kind::Motion, "i2", [](const cell::Experiment& e, Eigen::Index row) {
    return bend * std::pow(protocol::value(e, "i2", row), 2);
  });
  gap::DiagnoseOptions options;
  options.own_hypotheses = {gap::own_hypothesis(bent_sensor())};
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator(), options);
  CHECK(d.verdict == gap::Verdict::Explained);
  REQUIRE(d.causes.size() == 1);
  CHECK(d.causes[0].effect == "bent_sensor");
  CHECK(d.causes[0].target == "i2");
  REQUIRE(d.causes[0].parameters.size() == 1);
  const gap::ParameterEstimate& p = d.causes[0].parameters[0];
  CHECK(p.name == "bend");
  CHECK(p.unit == "1/A");
  CHECK(std::abs(p.value[0] - bend) < 5 * p.std[0] + 0.02 * bend);  // the noise of i2 is bent as well
}

TEST_CASE("an own effect that changes the cell is found", "[not_sanitized]") {
  Random random(22);
  cell::Cell truth = protocol::nominal();
  truth.robot.gravity *= 1.04;
  cell::Recording r = motions(truth, random);
  r.cell = protocol::nominal();
  gap::DiagnoseOptions options;
  options.own_hypotheses = {gap::own_hypothesis(heavy_world())};
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator(), options);
  REQUIRE(d.causes.size() == 1);
  CHECK(d.causes[0].effect == "heavy_world");
  CHECK(std::abs(d.causes[0].parameters[0].value[0] - 0.04) < 4 * d.causes[0].parameters[0].std[0]);
  CHECK(std::abs(d.cell.robot.gravity.z() / truth.robot.gravity.z() - 1) < 0.01);
}

TEST_CASE("a number that says nothing by itself is tried at its shapes") {
  gap::OwnEffect own = heavy_world();
  own.coordinates.push_back({"time_constant", "s", 10.0, 1.0, 1000.0, {5.0, 50.0, 500.0}});
  const gap::Hypothesis h = gap::own_hypothesis(own);
  REQUIRE(h.probes.size() == 3);
  CHECK(h.coordinates[1].shape);
  CHECK(h.probes[1].points.front() == Eigen::Vector2d(1.0, 5.0));
}

TEST_CASE("own effects that make no sense are refused") {
  const auto refused = [](const std::function<void(gap::OwnEffect&)>& spoil, const std::string& word) {
    gap::OwnEffect own = heavy_world();
    spoil(own);
    CHECK_THROWS_WITH(gap::own_hypothesis(own), Catch::Contains(word));
    CHECK_THROWS_AS(gap::own_hypothesis(own), InvalidArgument);
  };
  refused([](auto& e) { e.apply = nullptr; }, "apply");
  refused([](auto& e) { e.coordinates.clear(); }, "coordinate");
  refused([](auto& e) { e.coordinates[0].name = ""; }, "name");
  refused([](auto& e) { e.coordinates[0].size = 0.0; }, "size");
  refused([](auto& e) { e.coordinates[0].lower = 0.1; }, "0");
  refused([](auto& e) { e.coordinates[0].shapes = {1.0}; }, "shapes");
  refused([](auto& e) { e.effect = ""; }, "name");
}

TEST_CASE("an effect of a typical size is in the cell, for every effect and target of the shipped cell") {
  const cell::Cell nominal = protocol::nominal();
  for (const cell::Effect& effect : cell::effect_catalogue())
    for (const std::string& target : cell::effect_targets(effect, nominal)) {
      if (!cell::effect_possible(effect, nominal, target)) continue;
      CAPTURE(effect.id, target);
      const cell::Cell changed = gap::with_typical_effect(nominal, {effect.id, target}, {0.0, 100.0});
      CHECK_NOTHROW(changed.validate());
      const std::vector<cell::ActiveEffect> active = cell::active_effects(changed.effects);
      REQUIRE(active.size() == 1);
      CHECK(active[0].id == effect.id);
      CHECK(active[0].target == target);
    }
}

TEST_CASE("the typical size of an effect is that of its row") {
  const cell::Cell changed = gap::with_typical_effect(protocol::nominal(), {"load_friction", "joint2"});
  CHECK(cell::active_effects(changed.effects)[0].number("coefficient") == Approx(0.02).epsilon(1e-12));
}

TEST_CASE("a typical effect is refused for what the cell does not have") {
  CHECK_THROWS_WITH(gap::with_typical_effect(protocol::nominal(), {"load_friction", "joint7"}),
                    Catch::Contains("joint7"));
  CHECK_THROWS_WITH(gap::with_typical_effect(protocol::nominal(), {"load_frictoin", "joint1"}),
                    Catch::Contains("load_friction"));
}

}  // namespace hypotheses_test
