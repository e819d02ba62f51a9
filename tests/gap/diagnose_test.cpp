#include <kr5/gap/diagnose.hpp>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/io/node.hpp>
#include <kr5/predict/fast_simulator.hpp>
#include <kr5/uncertainty/confidence.hpp>
#include <support/trials.hpp>

#include "gap/protocol.hpp"
#include "gap/told.hpp"

using namespace kr5;
using told::blames;
using told::text;

TEST_CASE("every labelled recording is told right") {
  const std::filesystem::path folder = std::filesystem::path(KR5_REFERENCE_DIR) / "cases";
  if (!std::filesystem::exists(folder / "labels.json")) {
    WARN("no recordings in " << folder << ": skipped");
    REQUIRE(std::getenv("CI") == nullptr);
    return;
  }
  const io::Node labels = io::load_yaml(folder / "labels.json");
  for (const auto& [name, label] : labels.entries) {
    DYNAMIC_SECTION(name) {
      const gap::Diagnosis d = gap::diagnose(cell::load_recording(folder / name), predict::FastSimulator());
      INFO(text(d));
      const auto& effects = label.find("effects")->items;
      CHECK(d.verdict == (effects.empty() ? gap::Verdict::NoGap : gap::Verdict::Explained));
      CHECK(d.causes.size() == effects.size());
      for (const io::Node& e : effects) CHECK(blames(d, e.find("effect")->scalar, e.find("target")->scalar));
      if (!effects.empty()) CHECK(d.shrink.before > 2 * d.shrink.after);
    }
  }
}

TEST_CASE("single effects of random size are named") {
  // Of each draw: effect, target, parameter, and the size relative to what such an effect often is.
  const int trials = test::trials(100, 10);
  Random random(7);
  int named = 0;
  std::string missed;
  for (int i = 0; i < trials; ++i) {
    const protocol::Draw draw = protocol::draw_effect(random);
    cell::Recording r = protocol::record(draw.cell, random);
    const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
    const bool found = blames(d, draw.effect, draw.target);
    named += found;
    if (!found) missed += draw.effect + "." + draw.target + " -> " + text(d) + "\n";
  }
  INFO(missed);
  if (!test::full()) CHECK(named == trials);
  CHECK(uncertainty::binomial_interval(named, trials).high >= 0.95);
}

TEST_CASE("a healthy cell is called healthy") {
  const int trials = test::trials(100, 5);
  Random random(8);
  int healthy = 0;
  for (int i = 0; i < trials; ++i) {
    const gap::Diagnosis d = gap::diagnose(protocol::record(protocol::nominal(), random), predict::FastSimulator());
    INFO(text(d));
    healthy += d.verdict == gap::Verdict::NoGap && d.causes.empty();
  }
  if (!test::full()) CHECK(healthy == trials);
  CHECK(uncertainty::binomial_interval(healthy, trials).high >= 0.98);
}

TEST_CASE("noise that is twice what the cell declares is no gap, and is said") {
  Random random(9);
  cell::Recording r = protocol::record(protocol::nominal(), random);
  r.cell.noise.current /= 2;
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
  INFO(text(d));
  CHECK(d.verdict == gap::Verdict::NoGap);
  REQUIRE(d.warnings.size() == 1);
  CHECK(d.warnings[0].find("current") != std::string::npos);
}

TEST_CASE("a wrench that is logged late is warned of and blamed on no effect") {
  Random random(12);
  cell::Recording r = protocol::record(protocol::nominal(), random);
  protocol::late(r, cell::Kind::Motion, {"fx", "fy", "fz", "tx", "ty", "tz"}, 0.012);
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
  INFO(text(d));
  CHECK(d.causes.empty());
  CHECK(d.verdict == gap::Verdict::Unknown);
  CHECK(std::any_of(d.warnings.begin(), d.warnings.end(),
                    [](const std::string& w) { return w.starts_with("wrench of motion: logged 12."); }));
}

TEST_CASE("spikes are left out, also of poses and views, and the effect beside them is named") {
  Random random(13);
  cell::Recording r = protocol::record(protocol::carrying("encoder_offset", "joint2", "offset", 1e-3), random);
  const int spikes = protocol::add_spikes(r, 0.004, random);
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
  INFO(text(d));
  CHECK(d.verdict != gap::Verdict::Unknown);  // two spikes side by side may stand as a blow that stays
  REQUIRE(d.causes.size() == 1);
  CHECK(blames(d, "encoder_offset", "joint2"));
  CHECK(std::abs(d.causes[0].parameters[0].value[0] - 1e-3) < 4 * d.causes[0].parameters[0].std[0]);
  REQUIRE_FALSE(d.warnings.empty());
  CHECK(std::stoi(d.warnings[0]) > 0.8 * spikes);
}

TEST_CASE("poses alone name what moves the tool, or tie it") {
  Random random(14);
  const cell::Cell broken = protocol::carrying("link_twist", "joint2", "alpha", 2e-3);
  const cell::Recording r = protocol::only(protocol::record(broken, random), cell::Kind::Poses);
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
  INFO(text(d));
  CHECK(d.verdict == gap::Verdict::Explained);
  CHECK(blames(d, "link_twist", "joint2"));
}

TEST_CASE("what is fitted early in a warming is not held against what is seen later") {
  Random random(15);
  cell::Cell broken = protocol::carrying("thermal_friction", "joint1", "drop", 0.6);
  cell::set_effect(broken, "thermal_friction", "joint1", "time_constant", cell::EffectValue(150.0));
  const gap::Diagnosis d = gap::diagnose(protocol::record(broken, random), predict::FastSimulator());
  INFO(text(d));
  CHECK(d.verdict == gap::Verdict::Explained);
  CHECK(blames(d, "thermal_friction", "joint1"));
}

TEST_CASE("what no catalogue names is not explained") {
  Random random(10);
  int explained = 0, trials = 0;
  for (const auto& [name, change] : protocol::unknown_effects()) {
    cell::Recording r = protocol::record(protocol::nominal(), random);
    change(r);
    const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
    CAPTURE(name);
    INFO(text(d));
    CHECK(d.verdict != gap::Verdict::NoGap);
    explained += d.verdict == gap::Verdict::Explained;
    ++trials;
  }
  CHECK(explained == 0);
}

TEST_CASE("a recording of a few kinds is diagnosed by what there is") {
  Random random(11);
  const cell::Cell broken = protocol::carrying("coulomb_friction", "joint2", "coulomb", 50.0);
  const cell::Recording r = protocol::only(protocol::record(broken, random), cell::Kind::Motion);
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator());
  INFO(text(d));
  CHECK(d.verdict == gap::Verdict::Explained);
  REQUIRE(d.causes.size() == 1);
  CHECK(d.causes[0].effect == "coulomb_friction");
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
