#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/cell/check.hpp>
#include <kr5/cell/effect_registry.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/gap/diagnose.hpp>
#include <kr5/gap/effect_fit.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "gap/protocol.hpp"

namespace registered_effect_test {

using namespace kr5;
using Catch::Contains;

namespace {

/// A current sensor whose reading bends: i becomes i + bend i^2. The row and the law of an effect, all that it needs.
cell::Effect bent_sensor() {
  cell::Effect out{.id = "bent_sensor", .target = cell::EffectTarget::Motor};
  out.description = "current sensor that bends";
  out.shows_in = "the current of its motor: in proportion to its square";
  out.remedy = "Have the current sensor calibrated.";
  out.parameters = {{.name = "bend", .unit = "1/A", .lower = -0.5, .upper = 0.5, .usual_size = 0.01}};
  out.change_columns = [](io::Table& table, const cell::Experiment&, const cell::ActiveEffect& effect) {
    if (const int at = table.find("i" + std::to_string(effect.index + 1)); at >= 0)
      table.values.col(at).array() += effect.number("bend") * table.values.col(at).array().square();
  };
  return out;
}

/// Gravity other than believed: a law that changes the cell.
cell::Effect heavy_world() {
  cell::Effect out{.id = "heavy_world", .target = cell::EffectTarget::Base};
  out.parameters = {{.name = "part", .unit = "-", .lower = -0.5, .upper = 0.5, .usual_size = 0.01}};
  out.change_cell = [](cell::Cell& c, const cell::ActiveEffect& effect) {
    c.robot.gravity *= 1 + effect.number("part");
  };
  return out;
}

/// Takes the row out again, whatever a test does.
struct Registered {
  explicit Registered(cell::Effect effect) : id(effect.id) { cell::register_effect(std::move(effect)); }
  ~Registered() { cell::unregister_effect(id); }
  std::string id;
};

cell::Recording motions(const cell::Cell& truth, Random& random) {
  cell::Recording r = protocol::record(truth, random);
  std::erase_if(r.experiments, [](const cell::Experiment& e) { return e.kind != cell::Kind::Motion; });
  r.cell = protocol::nominal();
  return r;
}

}  // namespace

TEST_CASE("a registered effect stands in the catalogue and in cell files, and its bounds are checked") {
  const Registered row(bent_sensor());
  CHECK(cell::find_effect("bent_sensor").label == "bent sensor");
  CHECK(cell::effect_catalogue().back().id == "bent_sensor");
  cell::Cell c = protocol::nominal();
  cell::set_effect(c, "bent_sensor", "motor2", "bend", 0.03);
  const cell::Cell back = cell::parse_cell(cell::to_yaml(c), "t");
  CHECK(back.effects.number("bent_sensor", "bend", 1) == 0.03);
  CHECK(back.effects.number("bent_sensor", "bend", 0) == 0.0);
  CHECK(cell::check(back).empty());
  cell::set_effect(c, "bent_sensor", "motor2", "bend", 3.0);
  const auto wrong = cell::check(c);
  REQUIRE(wrong.size() == 1);
  CHECK_THAT(wrong[0].text(), Contains("effects.bent_sensor.motor2.bend") && Contains("-0.5 to 0.5 1/A"));
}

TEST_CASE(
    "a registered effect is simulated, diagnosed with its size and tried against others like any of the library") {
  const Registered row(bent_sensor());
  Random random(21);
  cell::Cell truth = protocol::nominal();
  cell::set_effect(truth, "bent_sensor", "motor2", "bend", 0.03);
  const cell::Recording r = motions(truth, random);
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
  CHECK(d.verdict == gap::Verdict::Explained);
  REQUIRE(d.causes.size() == 1);
  CHECK(d.causes[0].effect == "bent_sensor");
  CHECK(d.causes[0].target == "motor2");
  const gap::ParameterEstimate& p = d.causes[0].parameters.at(0);
  CHECK(p.name == "bend");
  CHECK(p.unit == "1/A");
  CHECK(std::abs(p.value[0] - 0.03) < 4 * p.std[0]);
  CHECK(d.cell.effects.number("bent_sensor", "bend", 1) == p.value[0]);
  const auto fitted = gap::fit_effects(r, r.cell, predict::FastSimulator(),
                                       {{"bent_sensor", "motor2"}, {"viscous_friction", "joint2"}});
  REQUIRE(fitted.size() == 2);
  CHECK(fitted[0].effect == "bent_sensor");
  CHECK(fitted[0].explained_fraction > 0.9);
}

TEST_CASE("the law of a registered effect may change the cell that is simulated") {
  const Registered row(heavy_world());
  Random random(22);
  cell::Cell heavy = protocol::nominal(), carrying = protocol::nominal();
  heavy.robot.gravity *= 1.04;
  cell::set_effect(carrying, "heavy_world", "base", "part", 0.04);
  const cell::Recording r = motions(heavy, random);
  const predict::FastSimulator simulator;
  for (const cell::Experiment& e : r.experiments) {
    const io::Table own = simulator.predict(carrying, e), plain = simulator.predict(heavy, e);
    CHECK((own.values - plain.values).cwiseAbs().maxCoeff() < 1e-12);
  }
}

TEST_CASE("a row that lacks something, or has the name of another, is refused") {
  const auto refused = [](const std::function<void(cell::Effect&)>& spoil, const std::string& word) {
    cell::Effect effect = bent_sensor();
    spoil(effect);
    CHECK_THROWS_WITH(cell::register_effect(effect), Contains(word));
    CHECK_THROWS_AS(cell::register_effect(effect), InvalidArgument);
  };
  refused([](auto& e) { e.id = ""; }, "needs an id");
  refused([](auto& e) { e.id = "backlash"; }, "the catalogue already has an effect of this name");
  refused([](auto& e) { e.change_columns = nullptr; }, "change_cell");
  refused([](auto& e) { e.parameters.clear(); }, "at least one parameter");
  refused([](auto& e) { e.parameters[0].name = ""; }, "no name");
  refused([](auto& e) { e.parameters[0].usual_size = 0.0; }, "usual_size");
  refused([](auto& e) { e.parameters[0].lower = 0.1; }, "must contain the off value");
  CHECK_THROWS_WITH(cell::unregister_effect("backlash"), Contains("is built into the library"));
  CHECK_THROWS_AS(cell::unregister_effect("bent_sensor"), InvalidArgument);
}

}  // namespace registered_effect_test
