#include <algorithm>
#include <fstream>
#include <regex>
#include <set>

#include <catch2/catch.hpp>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

#include "support/reference.hpp"

namespace effect_test {

using namespace kr5;
using namespace kr5::cell;
using Catch::Matchers::Contains;

namespace {

Cell sample() { return load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

/// A value inside the bounds of a parameter that is not its off value.
EffectValue some_value(const EffectParameter& p, Random& random) {
  const double low = std::max(p.lower, -10.0), high = std::min(p.upper, 10.0);
  if (p.kind == EffectValueKind::Whole) return std::round(random.uniform(std::max(low, 2.0), std::min(high, 5.0)));
  if (p.kind == EffectValueKind::Pose) return to_pose(random.normal_vector(6));
  const auto number = [&] { return random.uniform(low + 0.1 * (high - low), high); };
  if (p.kind == EffectValueKind::Number) return number();
  const int size = p.kind == EffectValueKind::Vector2 ? 2 : 3;
  return Eigen::VectorXd(Eigen::VectorXd::NullaryExpr(size, number));
}

bool equal(const EffectValue& a, const EffectValue& b) {
  if (a.index() != b.index()) return false;
  if (const auto* T = std::get_if<Pose>(&a)) return T->matrix() == std::get<Pose>(b).matrix();
  if (const auto* v = std::get_if<Eigen::VectorXd>(&a)) return *v == std::get<Eigen::VectorXd>(b);
  return std::get<double>(a) == std::get<double>(b);
}

std::string message(const auto& call) {
  try {
    call();
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("the catalogue holds every effect of the reference catalogue, on its target and with its parameters") {
  const auto file = test::reference("effects.md");
  std::ifstream stream(file);
  std::map<std::string, std::set<std::string>> wanted;
  std::map<std::string, std::string> targets;
  const std::regex word("`([^`]+)`");
  const auto words = [&](const std::string& text) {
    std::vector<std::string> out;
    for (std::sregex_iterator it(text.begin(), text.end(), word), end; it != end; ++it) {
      std::string list = (*it)[1];
      for (std::size_t at; (at = list.find(", ")) != std::string::npos; list = list.substr(at + 2))
        out.push_back(list.substr(0, at));
      out.push_back(list);
    }
    return out;
  };
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with("| `")) continue;
    std::vector<std::string> cells;
    for (std::size_t at = 1, next; (next = line.find('|', at)) != std::string::npos; at = next + 1)
      cells.push_back(line.substr(at, next - at));
    const auto ids = words(cells.at(0)), parameters = words(cells.at(2));
    std::string target = cells.at(1).substr(1, cells.at(1).size() - 2);
    std::replace(target.begin(), target.end(), ' ', '_');
    for (const std::string& id : ids) targets[id] = target;
    for (std::size_t i = 0; i < ids.size(); ++i)
      for (std::size_t p = 0; p < parameters.size(); ++p)
        if (cells[2].find('/') == std::string::npos || i == p) wanted[ids[i]].insert(parameters[p]);
  }
  REQUIRE_FALSE(wanted.empty());
  for (const auto& [id, names] : wanted) {
    CAPTURE(id);
    const Effect& row = find_effect(id);
    CHECK(name_of(row.target) == targets[id]);
    std::set<std::string> ours;
    for (const EffectParameter& p : row.parameters)
      if (p.name != "phase" && !p.with_and_without) ours.insert(p.name);  // "phase free": in the text below the table
    CHECK(ours == names);
  }
}

TEST_CASE("every parameter says what it is, in which unit and bounds, and is off by default") {
  const Effects off;
  for (const Effect& effect : effect_catalogue()) {
    CAPTURE(effect.id);
    CHECK_FALSE(effect.description.empty());
    for (const EffectParameter& p : effect.parameters) {
      CAPTURE(p.name);
      CHECK_FALSE(p.unit.empty());
      CHECK_FALSE(p.description.empty());
      CHECK(p.lower < p.upper);
      CHECK(p.nominal_when_off == p.off.empty());
      for (const double value : p.off) CHECK((value >= p.lower && value <= p.upper));
      const std::string target = effect_targets(effect, sample()).at(0);
      CHECK(get_effect(off, effect.id, target, p.name).has_value() == !p.nominal_when_off);
    }
  }
  CHECK(active_effects(off).empty());
}

TEST_CASE("each effect on each of its targets is set alone, survives the file, and is switched off again") {
  Random random(2);
  const Cell nominal = sample();
  const std::string before = to_yaml(nominal);
  for (const Effect& effect : effect_catalogue())
    for (const std::string& target : effect_targets(effect, nominal)) {
      CAPTURE(effect.id, target);
      Cell cell = nominal;
      for (const EffectParameter& p : effect.parameters)
        set_effect(cell, effect.id, target, p.name, some_value(p, random));
      const auto active = active_effects(cell.effects);
      REQUIRE(active.size() == 1);
      CHECK(active[0].id == effect.id);
      CHECK(active[0].target == target);
      REQUIRE(active[0].parameters.size() == effect.parameters.size());
      const Cell back = parse_cell(to_yaml(cell), "t");
      for (const auto& [name, value] : active[0].parameters)
        CHECK(equal(get_effect(back.effects, effect.id, target, name).value(), value));
      for (const EffectParameter& p : effect.parameters) set_effect(cell, effect.id, target, p.name, std::nullopt);
      CHECK(active_effects(cell.effects).empty());
      CHECK(to_yaml(cell) == before);
    }
}

TEST_CASE("a law reads what was set by name, and what is off otherwise") {
  Cell cell = sample();
  CHECK(cell.effects.number("stribeck_friction", "stribeck", 2) == 0.0);
  CHECK(std::isinf(cell.effects.number("joint_elasticity", "stiffness", 5)));
  set_effect(cell, "stribeck_friction", "joint3", "stribeck", 11.2);
  set_effect(cell, "coulomb_friction", "joint6", "coulomb", 3.2);
  set_effect(cell, "ft_gain", "tz", "gain", 1.1);
  set_effect(cell, "tube_tilt", "tube", "tilt", Eigen::VectorXd(Eigen::Vector2d(0.1, -0.2)));
  CHECK(cell.effects.number("stribeck_friction", "stribeck", 2) == 11.2);
  CHECK(cell.effects.replaced_number("coulomb_friction", "coulomb", 5) == 3.2);
  CHECK_FALSE(cell.effects.replaced_number("coulomb_friction", "coulomb", 4));
  CHECK(cell.effects.number("ft_gain", "gain", 5) == 1.1);
  CHECK(cell.effects.vector("tube_tilt", "tilt")[1] == -0.2);
}

TEST_CASE("targets follow the cell: joints are counted, and what a cell lacks carries no effect") {
  Cell cell = sample();
  CHECK(effect_targets(find_effect("backlash"), cell).size() == 6);
  CHECK(effect_targets(find_effect("wrist_coupling"), cell).at(5) == "motor6");
  CHECK(effect_targets(find_effect("ft_bias"), cell) == std::vector<std::string>{"fx", "fy", "fz", "tx", "ty", "tz"});
  CHECK(effect_targets(find_effect("hand_eye"), cell) == std::vector<std::string>{"camera"});
  cell.camera.reset();
  CHECK(effect_targets(find_effect("hand_eye"), cell).empty());
  CHECK_THAT(message([&] { set_effect(cell, "camera_focal", "camera", "fx", 2300.0); }),
             Contains("which this cell does not have"));
}

TEST_CASE("what cannot be set is refused with what could be") {
  Cell cell = sample();
  const auto set = [&](const char* id, const char* target, const char* parameter, const EffectValue& value) {
    return message([&] { set_effect(cell, id, target, parameter, value); });
  };
  CHECK_THAT(set("stribek_friction", "joint1", "stribeck", 1.0), Contains("did you mean 'stribeck_friction'?"));
  CHECK_THAT(set("rust", "joint1", "x", 1.0), Contains("no effect 'rust'; there are coulomb_friction, "));
  CHECK_THAT(set("backlash", "joint7", "gap", 1.0), Contains("this cell has no joint7") && Contains("joint1, joint2"));
  CHECK_THAT(set("backlash", "joint0", "gap", 1.0), Contains("sits on joint1, joint2, ..., found 'joint0'"));
  CHECK_THAT(set("backlash", "joint07", "gap", 1.0), Contains("found 'joint07'"));
  CHECK_THAT(set("ft_bias", "fw", "bias", 1.0), Contains("sits on fx | fy | fz | tx | ty | tz"));
  CHECK_THAT(set("backlash", "joint1", "width", 1.0), Contains("no parameter 'width'; there are gap"));
  CHECK_THAT(set("backlash", "joint1", "gap", Pose::Identity()), Contains("effects.backlash.joint1.gap is one number"));
  CHECK_THAT(set("backlash", "joint1", "gap", std::nan("")), Contains("is NaN"));
  CHECK_THAT(set("torque_ripple", "joint1", "cycles", 2.5), Contains("is a whole number"));
  CHECK_THAT(set("payload", "tool", "com", 1.0), Contains("is a list of 3 finite numbers"));
  CHECK_THAT(set("hand_eye", "camera", "T_E_C", 1.0), Contains("is a pose"));
  CHECK(active_effects(cell.effects).empty());
}

TEST_CASE("effects in a file are read in all their forms, and what is wrong with them is named") {
  const std::string text = to_yaml(sample());
  const Cell cell = parse_cell(
      text +
          "effects:\n  ft_crosstalk: {fz: {source: tx, gain: 0.02}}\n  tube_shift: {tube: {shift: [0.001, -0.002]}}\n"
          "  wrist_coupling: {motor5: {element: [4, 3], value: -1.05}}\n",
      "t");
  CHECK(cell.effects.number("ft_crosstalk", "source", 2) == 3);
  CHECK(cell.effects.vector("tube_shift", "shift") == Eigen::Vector3d(0.001, -0.002, 0.0));
  CHECK(cell.effects.number("wrist_coupling", "element", 4) == 3);
  CHECK(cell.effects.replaced_number("wrist_coupling", "value", 4) == -1.05);
  CHECK_THAT(to_yaml(cell), Contains("source: tx") && Contains("[0.001, -0.002]") && Contains("[4, 3]"));

  const auto wrong = [&](const std::string& effects) {
    return message([&] { parse_cell(text + "effects:\n" + effects, "cell.yaml"); });
  };
  CHECK_THAT(wrong("  bcklash: {joint1: {gap: 1}}\n"),
             Contains("effects.bcklash: found an unknown key, expected no such key; did you mean 'backlash'?"));
  CHECK_THAT(wrong("  backlash: {joint7: {gap: 0.001}}\n"),
             Contains("effects.backlash.joint7: found the target 'joint7', expected one of joint1, joint2"));
  CHECK_THAT(wrong("  backlash: {elbow: {gap: 0.001}}\n"),
             Contains("effects.backlash.elbow: found a map of 1, expected on joint1, joint2, ... only"));
  CHECK_THAT(wrong("  backlash: {joint1: {gaps: 0.001}}\n"),
             Contains("effects.backlash.joint1.gaps: found an unknown key, expected no such key; did you mean 'gap'?"));
  CHECK_THAT(wrong("  stribeck_friction: {joint1: {stribeck: 3}}\n"),
             Contains("effects.stribeck_friction.joint1.stribeck_velocity: found nothing"));
  CHECK_THAT(wrong("  backlash: {joint1: 0.001}\n"),
             Contains("effects.backlash.joint1: found '0.001', expected a map of parameter: value"));
  CHECK_THAT(wrong("  torque_ripple: {joint1: {amplitude: 1, cycles: 1.5}}\n"),
             Contains("cycles: found '1.5', expected a whole number"));
  CHECK_THAT(wrong("  link_length: {joint1: {}}\n"),
             Contains("effects.link_length.joint1: found a map of 0, expected at least one parameter"));
  CHECK_THAT(wrong("  ft_crosstalk: {fz: {source: 9, gain: 1}}\n"),
             Contains("source: found 9, expected a wrench component"));
  CHECK_THAT(wrong("  wrist_coupling: {motor5: {element: 6, value: 1}}\n"),
             Contains("a column of the structure matrix, 0 to 5"));
}

}  // namespace effect_test
