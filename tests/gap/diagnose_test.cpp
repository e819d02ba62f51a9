#include <kr5/gap/diagnose.hpp>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/gap/measure.hpp>
#include <kr5/io/node.hpp>
#include <kr5/predict/fast_simulator.hpp>
#include <support/rates.hpp>
#include <support/reference.hpp>
#include <support/trials.hpp>

#include "gap/diagnosis_matchers.hpp"
#include "gap/protocol.hpp"

namespace diagnose_test {

using namespace kr5;
using test::names_only;
using test::text;

TEST_CASE("every labelled recording is told right", "[long][not_sanitized]") {
  const std::filesystem::path folder = test::reference("cases");
  const io::Node labels = io::load_yaml(folder / "labels.json");
  REQUIRE(labels.entries.size() == 14);
  int number = 0;
  for (const auto& [name, label] : labels.entries) {
    // A short run takes those without an effect and with two, and every third of the others.
    const bool single = label.find("effects")->items.size() == 1;
    if (number++ % 3 != 0 && single && !test::full()) continue;
    DYNAMIC_SECTION(name) {
      const gap::Diagnosis d = gap::diagnose(cell::load_recording(folder / name), predict::FastSimulator());
      INFO(text(d));
      std::vector<gap::EffectName> effects;
      for (const io::Node& e : label.find("effects")->items)
        effects.push_back({e.find("effect")->scalar, e.find("target")->scalar});
      CHECK(d.verdict == (effects.empty() ? gap::Verdict::NoGap : gap::Verdict::Explained));
      CHECK(names_only(d, effects));
      if (!effects.empty()) CHECK(d.reduction.before > 2 * d.reduction.after);
    }
  }
}

TEST_CASE("single effects of random size are named, and nothing beside them", "[statistics][not_sanitized]") {
  // Of each draw: effect, target, parameter, and the size relative to what such an effect often is.
  const int trials = test::trials(100, 10);
  Random random(7);
  int named = 0;
  std::string missed;
  for (int i = 0; i < trials; ++i) {
    const protocol::Draw draw = protocol::draw_effect(random);
    cell::Recording r = protocol::record(draw.cell, random);
    const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
    const bool found = names_only(d, {{draw.effect, draw.target}});
    named += found;
    if (!found) missed += draw.effect + "." + draw.target + " -> " + text(d) + "\n";
  }
  INFO(missed);
  test::check_rate(named, trials, 0.95, 0.9);
}

TEST_CASE("a payload is found with its rotary inertia, and without where it is a point", "[not_sanitized]") {
  for (const double inertia : {0.0, 0.03}) {
    CAPTURE(inertia);
    Random random(5);
    const Eigen::VectorXd com = Eigen::Vector3d(0.02, -0.01, 0.09);
    cell::Cell truth = protocol::carrying("payload", "tool", "mass", 0.8);
    cell::set_effect(truth, "payload", "tool", "com", com);
    if (inertia > 0.0) cell::set_effect(truth, "payload", "tool", "inertia", inertia);
    const gap::Diagnosis d = gap::diagnose(protocol::record(truth, random), predict::FastSimulator());
    REQUIRE(names_only(d, {{"payload", "tool"}}));
    const auto& found = d.causes[0].parameters;
    REQUIRE(found.size() == (inertia > 0.0 ? 3 : 2));
    const std::vector<std::vector<double>> true_values = {{0.8}, {com[0], com[1], com[2]}, {inertia}};
    for (std::size_t p = 0; p < found.size(); ++p)
      for (std::size_t i = 0; i < found[p].value.size(); ++i) {
        INFO(found[p].name << " " << i);
        CHECK(std::abs(found[p].value[i] - true_values[p][i]) < 4 * found[p].std[i]);
      }
  }
}

TEST_CASE("a healthy cell is called healthy", "[statistics]") {
  const int trials = test::trials(100, 5);
  Random random(8);
  int healthy = 0;
  for (int i = 0; i < trials; ++i) {
    const gap::Diagnosis d = gap::diagnose(protocol::record(protocol::nominal(), random), predict::FastSimulator());
    healthy += d.verdict == gap::Verdict::NoGap && d.causes.empty();
  }
  test::check_rate(healthy, trials, 0.98, 0.92);
}

TEST_CASE("noise that is twice what the cell declares is no gap, and is said", "[not_sanitized]") {
  Random random(9);
  cell::Recording r = protocol::record(protocol::nominal(), random);
  r.cell.noise.current /= 2;
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
  INFO(text(d));
  CHECK(d.verdict == gap::Verdict::NoGap);
  REQUIRE(d.noise.size() == 1);
  CHECK(d.noise[0].key == "current");
  CHECK(std::abs(d.noise[0].ratio - 2.0) < 4 * d.noise[0].std);
  CHECK(gap::warnings(d).size() == 1);
}

TEST_CASE("a wrench that is logged late is warned of and blamed on no effect", "[not_sanitized]") {
  Random random(12);
  cell::Recording r = protocol::record(protocol::nominal(), random);
  protocol::late(r, cell::Kind::Motion, {"fx", "fy", "fz", "tx", "ty", "tz"}, 0.012);
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
  INFO(text(d));
  CHECK(d.causes.empty());
  CHECK(d.verdict == gap::Verdict::Unknown);
  REQUIRE(d.clock_faults.size() == 1);
  CHECK(d.clock_faults[0].group == "wrench");
  CHECK(d.clock_faults[0].kinds == std::vector{cell::Kind::Motion});
  CHECK(std::abs(d.clock_faults[0].delay - 0.012) < 4 * d.clock_faults[0].std);
}

TEST_CASE("spikes are left out, also of poses and views, and the effect beside them is named", "[not_sanitized]") {
  Random random(13);
  cell::Recording r = protocol::record(protocol::carrying("encoder_offset", "joint2", "offset", 1e-3), random);
  const int spikes = protocol::add_spikes(r, 0.004, random);
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
  INFO(text(d));
  CHECK(d.verdict != gap::Verdict::Unknown);  // two spikes side by side may stand as a blow that stays
  REQUIRE(names_only(d, {{"encoder_offset", "joint2"}}));
  CHECK(std::abs(d.causes[0].parameters[0].value[0] - 1e-3) < 4 * d.causes[0].parameters[0].std[0]);
  CHECK(d.spikes > 0.8 * spikes);
}

TEST_CASE("poses alone name what moves the tool, or tie it") {
  Random random(14);
  const cell::Cell broken = protocol::carrying("link_twist", "joint2", "alpha", 2e-3);
  const cell::Recording r = protocol::only(protocol::record(broken, random), cell::Kind::Poses);
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
  INFO(text(d));
  CHECK(d.verdict == gap::Verdict::Explained);
  CHECK(names_only(d, {{"link_twist", "joint2"}}));
}

TEST_CASE("what is fitted early in a warming is not held against what is seen later", "[not_sanitized]") {
  Random random(15);
  cell::Cell broken = protocol::carrying("thermal_friction", "joint1", "drop", 0.6);
  cell::set_effect(broken, "thermal_friction", "joint1", "time_constant", cell::EffectValue(150.0));
  const gap::Diagnosis d = gap::diagnose(protocol::record(broken, random), predict::FastSimulator());
  INFO(text(d));
  CHECK(d.verdict == gap::Verdict::Explained);
  CHECK(names_only(d, {{"thermal_friction", "joint1"}}));
}

namespace {

struct Carried {
  const char *effect, *target, *parameter;
  double value;
};

/// Effects that act on different parts of a cell.
const std::vector<Carried> five_effects = {{"coulomb_friction", "joint2", "coulomb", 52.0},
                                           {"ft_bias", "fy", "bias", 0.6},
                                           {"encoder_offset", "joint3", "offset", 1.5e-3},
                                           {"tool_servo", "servo", "natural_frequency", 2.5},
                                           {"torque_constant", "joint4", "torque_constant", 0.42}};

cell::Cell carrying_first(std::size_t count) {
  cell::Cell out = protocol::nominal();
  for (std::size_t i = 0; i < count; ++i) {
    const Carried& e = five_effects[i];
    cell::set_effect(out, e.effect, e.target, e.parameter, cell::EffectValue(e.value));
  }
  return out;
}

/// Excess over noise of the check experiments with a cell: sum of squares over the noise.
double check_misfit(const cell::Recording& r, const cell::Cell& cell) {
  double sum = 0.0;
  for (const gap::ColumnGap& c : gap::measure(r, cell, predict::FastSimulator()).columns)
    if (c.split == cell::Split::Check) sum += c.gap * c.gap * c.rows;
  return sum;
}

}  // namespace

TEST_CASE("several effects on one cell are all named, and each makes the check experiments fit better",
          "[long][not_sanitized]") {
  gap::DiagnoseOptions options;
  options.max_effects = 6;
  for (const std::size_t count : {3u, 5u}) {
    DYNAMIC_SECTION(count << " effects") {
      Random random(30 + count);
      const cell::Recording r = protocol::record(carrying_first(count), random);
      const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator(), options);
      INFO(text(d));
      CHECK(d.verdict == gap::Verdict::Explained);
      std::vector<gap::EffectName> carried;
      for (std::size_t i = 0; i < count; ++i) carried.push_back({five_effects[i].effect, five_effects[i].target});
      CHECK(names_only(d, carried));
      const double with_all = check_misfit(r, d.cell);
      for (const gap::Cause& cause : d.causes) {
        cell::Cell without = d.cell;
        without.effects.remove(cause.effect);
        CHECK(check_misfit(r, without) > with_all);
        CHECK(cause.explained_fraction > 0.0);
      }
    }
  }
}

TEST_CASE("friction that is added to the currents by a formula of its own is named", "[not_sanitized]") {
  Random random(14);
  for (const auto& [effect, target, add] : protocol::added_frictions()) {
    cell::Recording r = protocol::record(protocol::nominal(), random);
    add(r);
    const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
    INFO(effect << ": " << text(d));
    CHECK(d.verdict == gap::Verdict::Explained);
    CHECK(names_only(d, {{effect, target}}));
  }
}

TEST_CASE("friction while the load drives is told from friction that grows with the load", "[not_sanitized]") {
  Random random(15);
  for (const char* effect : {"driven_friction", "load_friction"}) {
    const cell::Cell broken = protocol::carrying(effect, "joint2", "coefficient", 0.06);
    const cell::Recording r = protocol::only(protocol::record(broken, random), cell::Kind::Motion);
    const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
    INFO(effect << ": " << text(d));
    CHECK(d.verdict == gap::Verdict::Explained);
    REQUIRE(names_only(d, {{effect, "joint2"}}));
    CHECK(d.causes[0].effect == effect);
    CHECK(std::abs(d.causes[0].parameters[0].value[0] - 0.06) < 4 * d.causes[0].parameters[0].std[0]);
  }
}

TEST_CASE("what no catalogue names is not explained", "[not_sanitized]") {
  Random random(10);
  std::vector<protocol::Change> unknown = protocol::unknown_effects();
  const auto kinds = static_cast<int>(unknown.size());
  REQUIRE(kinds == 8);
  unknown.resize(test::trials(kinds, kinds));
  for (const auto& [name, change] : unknown) {
    cell::Recording r = protocol::record(protocol::nominal(), random);
    change(r);
    const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
    CAPTURE(name);
    INFO(text(d));
    CHECK(d.verdict == gap::Verdict::Unknown);
    CHECK(names_only(d, {}));
    CHECK(d.reduction.after == d.reduction.before);
  }
}

TEST_CASE("a recording of a few kinds is diagnosed by what there is", "[not_sanitized]") {
  Random random(11);
  const cell::Cell broken = protocol::carrying("coulomb_friction", "joint2", "coulomb", 50.0);
  const cell::Recording r = protocol::only(protocol::record(broken, random), cell::Kind::Motion);
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
  INFO(text(d));
  CHECK(d.verdict == gap::Verdict::Explained);
  REQUIRE(names_only(d, {{"coulomb_friction", "joint2"}}));
  CHECK(std::abs(d.causes[0].parameters[0].value[0] - 50.0) < 4 * d.causes[0].parameters[0].std[0]);
}

TEST_CASE("options and recordings that make no sense are refused") {
  gap::DiagnoseOptions options;
  options.false_alarms = 2.0;
  CHECK_THROWS_AS(options.validate(), InvalidArgument);
  cell::Recording empty;
  empty.cell = protocol::nominal();
  CHECK_THROWS_AS(gap::diagnose(empty, predict::FastSimulator()), InvalidArgument);
}

}  // namespace diagnose_test
