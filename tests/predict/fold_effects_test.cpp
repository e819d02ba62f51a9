#include <kr5/physics/fold_effects.hpp>

#include <algorithm>
#include <set>

#include <catch2/catch.hpp>

#include <kr5/cell/effect_registry.hpp>

#include "predict/world.hpp"
#include "support/arm_cells.hpp"
#include "support/usual_effect.hpp"

namespace fold_effects_test {

using namespace kr5;
using namespace kr5::test;
using cell::Effect;
using cell::EffectParameter;
using cell::EffectSite;
using Eigen::VectorXd;
using physics::fold_effects;
using physics::FoldedCell;

namespace {

/// Greatest difference of a column, over the spread of its values, in all experiments.
double difference(const World& w, const cell::Cell& a, const cell::Cell& b) {
  double worst = 0.0;
  for (const cell::Experiment& experiment : w.experiments) {
    const io::Table x = predict::FastSimulator().predict(a, experiment),
                    y = predict::FastSimulator().predict(b, experiment);
    REQUIRE(x.columns == y.columns);
    for (Eigen::Index c = 0; c < x.values.cols(); ++c) {
      const auto seen = x.values.col(c).array().isFinite() && y.values.col(c).array().isFinite();
      REQUIRE((x.values.col(c).array().isFinite() == seen).all());
      REQUIRE((y.values.col(c).array().isFinite() == seen).all());
      const Eigen::ArrayXd away = seen.select(x.values.col(c) - y.values.col(c), 0.0),
                           size = seen.select(x.values.col(c), 0.0);
      worst = std::max(worst, away.abs().maxCoeff() / (1e-3 + size.abs().maxCoeff()));
    }
  }
  return worst;
}

constexpr double rounding = 1e-11, visible = 1e-7;

std::set<std::string> ids(const auto& effects) {
  std::set<std::string> out;
  for (const auto& e : effects) out.insert(e.effect.id);
  return out;
}

/// Effects that a cell may carry.
std::vector<Effect> possible_effects(const cell::Cell& cell) {
  std::vector<Effect> out = cell::effect_catalogue();
  std::erase_if(out, [&](const Effect& effect) { return !cell::lacking_part(effect, cell).empty(); });
  return out;
}

/// Of these, those that have a place in a cell with all their parameters: what replaces a value of it, and a few
/// additions.
std::set<std::string> with_a_place(const cell::Cell& cell) {
  std::set<std::string> out = {"base_tilt", "encoder_offset", "payload", "tool_offset"};
  for (const Effect& effect : possible_effects(cell))
    if (std::ranges::any_of(effect.parameters, &EffectParameter::nominal_when_off)) out.insert(effect.id);
  return out;
}

/// A part of the World whose motion is short, and whose views are few.
World small_world() {
  World out;
  out.of(cell::Kind::Motion) = motion_experiment(120);
  return out;
}

}  // namespace

TEST_CASE("an effect that is folded shows in every column as before, on every target") {
  const World w = small_world();
  std::set<std::string> folded;
  for (const Effect& effect : possible_effects(w.cell)) {
    int index = 0;
    for (const std::string& target : cell::effect_targets(effect, w.cell)) {
      INFO(effect.id << " on " << target);
      cell::Cell with = w.cell;
      put_usual(with, effect, target, index++);
      REQUIRE(with.valid());
      REQUIRE(cell::active_effects(with.effects).size() == 1);
      const FoldedCell found = fold_effects(with);
      CHECK(difference(w, with, found.cell) < rounding);
      CHECK(found.cell.valid());
      CHECK(found.folded.size() + found.remaining.size() >= 1);
      CHECK(cell::active_effects(found.cell.effects).size() == found.remaining.size());
      if (found.folded.empty()) continue;
      CHECK(difference(w, with, w.cell) > visible);
      CHECK_FALSE(found.folded[0].field.empty());
      if (found.remaining.empty()) folded.insert(effect.id);
    }
  }
  CHECK(folded == with_a_place(w.cell));
}

TEST_CASE("all effects of a cell at once show as before, whichever of them are folded") {
  const World w = small_world();
  cell::Cell with = w.cell;
  for (const Effect& effect : possible_effects(w.cell)) {
    const auto targets = cell::effect_targets(effect, w.cell);
    for (std::size_t i = 0; i < targets.size(); i += 2) put_usual(with, effect, targets[i], static_cast<int>(i));
  }
  REQUIRE(with.valid());
  const FoldedCell found = fold_effects(with);
  CHECK(difference(w, with, found.cell) < rounding);
  std::set<std::string> expected = with_a_place(w.cell), without;
  for (const Effect& effect : possible_effects(w.cell))
    if (!expected.contains(effect.id)) without.insert(effect.id);
  expected.insert("gripper_compliance");  // along its axis it has a place, across it none
  CHECK(ids(found.folded) == expected);
  CHECK(ids(found.remaining) == without);
  for (const auto& left : found.remaining) CHECK(left.reason == "no nominal parameter of a cell describes it");
  const FoldedCell again = fold_effects(found.cell);
  CHECK(again.folded.empty());
}

TEST_CASE("the places of folded effects are the fields that the cell names") {
  World w;
  const auto fields = [](const cell::Cell& cell) {
    std::vector<std::string> out;
    for (const auto& e : fold_effects(cell).folded) out.push_back(e.effect.id + " " + e.effect.target + " " + e.field);
    return out;
  };
  w = w.with("viscous_friction", "joint3", {{"viscous", 12.0}}).with("payload", "tool", {{"mass", 0.5}});
  w = w.with("gripper_compliance", "gripper", {{"axial", 1e-6}, {"lateral", 2e-6}});
  CHECK(fields(w.cell) == std::vector<std::string>{"viscous_friction joint3 drives.friction.viscous[2]",
                                                   "payload tool tool.mass, tool.com, tool.inertia",
                                                   "gripper_compliance gripper contact.stiffness"});
  const FoldedCell found = fold_effects(w.cell);
  CHECK(found.cell.drives->friction.viscous[2] == 12.0);
  CHECK(found.cell.tool->mass == w.cell.tool->mass + 0.5);
  CHECK(found.cell.contact->stiffness == Approx(1.0 / (1.0 / w.cell.contact->stiffness + 1e-6)).epsilon(1e-14));
  REQUIRE(found.remaining.size() == 1);
  CHECK(found.remaining[0].effect.parameters.size() == 1);
  CHECK(found.remaining[0].effect.parameters[0].first == "lateral");
}

TEST_CASE("friction of a cell without drives stays an effect, or goes into drives of unit gear") {
  World w = small_world();
  w.cell.drives.reset();
  cell::set_effect(w.cell, "coulomb_friction", "joint2", "coulomb", 7.0);
  const FoldedCell kept = fold_effects(w.cell);
  CHECK(kept.folded.empty());
  REQUIRE(kept.remaining.size() == 1);
  CHECK_THAT(kept.remaining[0].reason, Catch::Contains("no drives"));
  CHECK_FALSE(kept.cell.drives.has_value());
  const FoldedCell added = fold_effects(w.cell, {.add_drives = true});
  REQUIRE(added.cell.drives.has_value());
  CHECK(added.cell.drives->friction.coulomb[1] == 7.0);
  World driven = w;
  driven.cell = added.cell;
  for (const char* i : {"1", "2", "5"})  // a current is a torque
    CHECK((driven.show(cell::Kind::Motion, std::string("i") + i) - w.show(cell::Kind::Motion, std::string("tau") + i))
              .cwiseAbs()
              .maxCoeff() < 1e-10);
}

TEST_CASE("the zero of a slide is a length, unless the arm grows") {
  cell::Cell cell = arm_cell({"rprr"});
  cell::set_effect(cell, "encoder_offset", "joint2", "offset", 0.01);
  const FoldedCell found = fold_effects(cell);
  CHECK(found.cell.robot.dh[1].b == cell.robot.dh[1].b + 0.01);
  CHECK(found.cell.robot.dh[1].theta_offset == cell.robot.dh[1].theta_offset);
  cell::set_effect(cell, "thermal_growth", "links", "growth", 1e-3);
  const FoldedCell growing = fold_effects(cell);
  CHECK(growing.folded.empty());
  CHECK_THAT(growing.remaining[0].reason, Catch::Contains("does not grow"));
}

TEST_CASE("a value that no cell may have stays an effect") {
  World w;
  w = w.with("tube_radius", "tube", {{"inner_radius", 0.9 * w.cell.peg->radius}});
  const FoldedCell found = fold_effects(w.cell);
  CHECK(found.folded.empty());
  REQUIRE(found.remaining.size() == 1);
  CHECK(found.remaining[0].reason == "no cell may have this value");
  CHECK(found.cell.tube->inner_radius == w.cell.tube->inner_radius);
}

TEST_CASE("a registered effect that changes the cell is applied, one that changes columns stays") {
  const World w = small_world();
  Effect heavy{.id = "heavy_world", .target = cell::EffectTarget::Base};
  heavy.parameters = {{.name = "part", .unit = "-", .lower = -0.5, .upper = 0.5, .usual_size = 0.01}};
  heavy.change_cell = [](cell::Cell& c, const cell::ActiveEffect& e) { c.robot.gravity *= 1 + e.number("part"); };
  Effect bent{.id = "bent_log", .target = cell::EffectTarget::Base};
  bent.parameters = heavy.parameters;
  bent.change_columns = [](io::Table& table, const cell::Experiment&, const cell::ActiveEffect& e) {
    table.values *= 1 + e.number("part");
  };
  cell::register_effect(heavy);
  cell::register_effect(bent);
  cell::Cell with = w.cell;
  for (const char* id : {"heavy_world", "bent_log"}) cell::set_effect(with, id, "base", "part", 0.02);
  const FoldedCell found = fold_effects(with);
  CHECK(ids(found.folded) == std::set<std::string>{"heavy_world"});
  CHECK(ids(found.remaining) == std::set<std::string>{"bent_log"});
  CHECK(found.cell.robot.gravity.z() == Approx(-9.81 * 1.02));
  CHECK(difference(w, with, found.cell) < rounding);
  cell::unregister_effect("heavy_world");
  cell::unregister_effect("bent_log");
}

}  // namespace fold_effects_test
