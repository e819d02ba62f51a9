#include <kr5/gap/words.hpp>

#include <set>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>

/// @file
/// Names of what a diagnosis speaks of.

namespace words_test {

using namespace kr5;

TEST_CASE("every kind of experiment and of variable has words of its own") {
  std::set<std::string> kinds, shown, variables;
  for (const auto& [kind, name] : enum_names(cell::Kind{})) {
    kinds.insert(gap::kind_text(kind));
    shown.insert(gap::shown_by(kind));
  }
  CHECK(kinds.size() == 7);
  CHECK(shown.size() == 7);
  for (const auto& [kind, name] : enum_names(gap::VariableKind{}))
    if (kind != gap::VariableKind::None) variables.insert(gap::variable_text({kind, 3, "i3"}, "motion"));
  CHECK(variables.size() == 10);
  CHECK_FALSE(variables.contains(""));
  CHECK(variables.contains("speed of joint 3"));
}

TEST_CASE("columns, parts and targets are named, and what is not known stands as it is") {
  CHECK(gap::split_group("motion.i3") == std::pair<std::string, std::string>("motion", "i3"));
  CHECK(gap::column_text("motion.i3") == cell::find_column(cell::Kind::Motion, "i3").label);
  CHECK(gap::column_text("motion.none") == "motion.none");
  CHECK(gap::part_of("motion.fx") == "sensor");
  CHECK(gap::part_of("motion.i3") == "joint3");
  CHECK(gap::part_text("joint3") == "joint 3");
  CHECK(gap::part_text("laser") == "scanner");
  CHECK(gap::target_text("servo") == "path correction");
  CHECK(gap::target_text("motor5") == "motor 5");
  CHECK(gap::target_text("fx") == "force x");
  CHECK(gap::target_text("ty") == "torque about y");
}

TEST_CASE("effects are named with their targets, those of many joints together") {
  const std::string label = cell::find_effect("viscous_friction").label;
  CHECK(gap::effect_text({"viscous_friction", "joint2"}) == label + " of joint 2");
  CHECK(gap::effects_text("viscous_friction", {"joint1", "joint3", "joint4"}) == label + " of joints 1, 3 and 4");
  CHECK(gap::effects_text("viscous_friction", {}) == label);
  CHECK(gap::effects_text("viscous_friction", {"joint1", "tool"}) == label + " of joint 1 and " + label + " (tool)");
  CHECK(gap::joint_name({"a", "elbow"}, "joint2") == "elbow");
  CHECK(gap::joint_name({"joint_1"}, "joint1").empty());  // but its number
  CHECK(gap::joint_name({"a"}, "joint2").empty());
}

TEST_CASE("values are in units of people, with one uncertainty where it is common") {
  CHECK(gap::value_text({"offset", {1.5e-3}, {2e-5}, "m"}, "tool") == "1.500 ± 0.020 mm");
  CHECK(gap::value_text({"com", {0.01, 0.02}, {1e-3, 1e-3}, "m"}, "joint2") == "10.0, 20.0 ± 1.0 mm");
  CHECK(gap::value_text({"com", {0.01, 0.02}, {1e-3, 2e-3}, "m"}, "joint2") == "10.0 ± 1.0, 20.0 ± 2.0 mm");
  CHECK(gap::display_unit("N or N.m", {2.0}, "tx").second == "N m");
  CHECK(gap::display_unit("N or N.m", {2.0}, "fx").second == "N");
}

}  // namespace words_test
