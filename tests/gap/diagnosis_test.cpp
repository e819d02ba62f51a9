#include <limits>
#include <string>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/gap/diagnosis.hpp>
#include <kr5/gap/notes.hpp>
#include <kr5/gap/sentences.hpp>

namespace diagnosis_test {

using namespace kr5;
using namespace kr5::gap;

namespace {

/// A diagnosis with something in every field.
Diagnosis full() {
  Diagnosis d;
  d.verdict = Verdict::PartlyExplained;
  Dependence turns{{VariableKind::JointSpeed, 2}, Shape::Between, 2, 0.1, 0.25, "rad/s"};
  turns.evidence = 0.999;
  turns.share = 0.4;
  Dependence swings{{VariableKind::Column, 0, "t"}, Shape::Oscillates};
  swings.period = 0.6981317007977318;
  Dependence differs{{VariableKind::JointPosition, 3, "", "poses"}, Shape::EffectDiffers};
  differs.effect = {"coulomb_friction", "joint2"};
  d.where = {{"motion", "i2", "joint2", 7.0 / 3.0, 0.6, {turns, swings}}, {"poses", "z", "tool", 12.0, 0.4, {differs}}};
  d.unexplained = {d.where[1]};
  Cause friction{{"coulomb_friction", "joint2"}, 0.97, {{"coulomb", {25.0 / 7.0}, {0.1}, "N.m"}}, 0.9, {}};
  friction.tied_with = {{"stribeck_friction", "joint2"}};
  std::vector<double> pose(16, 0.1);
  pose[5] = 1.0 / 3.0;
  d.causes = {friction, {{"hand_eye", "camera"}, 0.8, {{"T_E_C", pose, {1, 2, 3, 4, 5, 6}, "m, rad"}}, 0.1, {}}};
  d.reduction = {9.4, 1.02, 1.0, {9, 10}, {1, 1.1}, {{"motion.i2", 7.0, 1.0}, {"poses.z", 12.0, 3.0}}};
  d.next_experiment = {{{"coulomb_friction", "joint2"}, {"stribeck_friction", "joint2"}},
                       cell::Kind::Motion,
                       "swing joint 2",
                       38.0,
                       4.4,
                       true};
  d.nearest = {
      {{"backlash", "joint1"}, 3.5, NotBlamed::StructureRemains, "motion.i3", {VariableKind::JointPosition, 1}}};
  d.not_tried = {{"payload", {}, NotTried::PartMissing, "tool"}, {"tool_delay", {"servo"}, NotTried::NotRecorded}};
  d.nuisance_std = 0.004;
  d.scope = {{ScopeReason::FewRows, cell::Kind::Poses, "poses-1", 4}, {ScopeReason::OneKind, cell::Kind::Motion}};
  d.noise = {{"force", cell::Kind::Press, 1.0 / 1.5, 0.02}, {"current", std::nullopt, 1.234567890123, 0.01}};
  d.clock_faults = {{"wrench", {cell::Kind::Press, cell::Kind::Profile}, -0.0065, 0.00025}};
  d.spikes = 22;
  d.outliers = 1;
  d.coarse = {{"motion-1", "tz"}};
  d.left_out = {{cell::Kind::Motion, "", {"i1", "i2"}, LeftOutReason::NotPredicted, ""},
                {cell::Kind::Profile, "profile-1", {}, LeftOutReason::Refused, "the cell has no peg"}};
  d.missing_splits = {{cell::Kind::Views, cell::Split::Fit}};
  d.excused = {{"motion.tau3", 0.25}};
  d.clock_reset = true;
  d.effects_limit = 6;
  d.sets_limit = 20;
  d.joint_names = {"shoulder", "elbow"};
  d.notes = {"true"};
  return d;
}

std::string replaced(std::string text, const std::string& old, const std::string& by) {
  const std::size_t at = text.find(old);
  REQUIRE(at != std::string::npos);
  return text.replace(at, old.size(), by);
}

/// As a version before format 2 wrote it.
const std::string old_file = R"({
 "format": "kr5-gap/1", "version": "0.2.0", "input": {"recording": "monday"}, "verdict": "unknown",
 "where": [{"experiment": "motion", "column": "i2", "target": "joint2", "joint": "elbow", "gap": 7.0, "share": 1.0,
            "depends_on": [{"variable": "|qd2|", "how": "changes sign with qd2, below 0.1 rad/s", "evidence": 1.0}]}],
 "causes": [{"effect": "hand_eye", "target": "camera", "probability": 0.9, "gap_closed": 0.5, "tied_with": [],
             "parameters": {"T_E_C": {"value": [[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
                                      "std": [1, 2, 3, 4, 5, 6], "unit": "m, rad"},
                            "lag": {"value": 0.5, "std": null, "unit": "s"}}}],
 "unexplained": [{"experiment": "motion", "column": "i2", "joint": "elbow", "gap": null, "depends_on": []}],
 "shrink": {"before": 9.4, "after": 1.02, "floor": 1.0, "before_ci": [9, 10], "after_ci": [1, 1.1],
            "columns": {"motion.i2": [7.0, 1.0]}},
 "next_experiment": {"separates": ["stribeck_friction joint2", "payload tool"], "do": "run the motion faster"},
 "nearest": [{"effect": "backlash", "target": "joint1", "gap": 3.0, "reason": "it fits the check experiments worse"}],
 "not_tried": [{"effect": "payload", "targets": [], "reason": "the cell has no tool"}],
 "nuisance_std": 0.004, "scope": ["motion-1 commands no motion"],
 "warnings": ["noise of current is 1.10 +- 0.01 times what the cell declares; the measured noise is used"]})";

}  // namespace

TEST_CASE("a diagnosis reads back from its JSON, every number exactly") {
  const Diagnosis before = full();
  const std::string text = to_json(before);
  const Diagnosis after = diagnosis_from_json(text);
  CHECK(to_json(after) == text);  // of all fields that are written
  CHECK(after.where[0].gap == before.where[0].gap);
  CHECK(after.where[0].depends_on[0].lower == before.where[0].depends_on[0].lower);
  CHECK(after.where[0].depends_on[0].share == before.where[0].depends_on[0].share);
  CHECK(after.where[0].depends_on[1].period == before.where[0].depends_on[1].period);
  CHECK(after.causes[1].parameters[0].value == before.causes[1].parameters[0].value);
  CHECK(after.noise[1].ratio == before.noise[1].ratio);
  CHECK(after.noise[0].kind == cell::Kind::Press);
  CHECK(after.clock_faults[0].delay == before.clock_faults[0].delay);
  CHECK(after.next_experiment.separates == before.next_experiment.separates);
  CHECK(after.joint_names == before.joint_names);
  CHECK(after.notes == before.notes);
  CHECK(verdict_text(after) == verdict_text(before));
  CHECK(warnings(after) == warnings(before));
}

TEST_CASE("sentences in a JSON are not read back") {
  const Diagnosis d = full();
  const std::string text = to_json(d);
  const std::string said = verdict_text(d);
  CHECK(to_json(diagnosis_from_json(replaced(text, said, "All is well."))) == text);
  CHECK(to_json(diagnosis_from_json(replaced(text, "22 samples are spikes", "9999 samples are spikes"))) == text);
}

TEST_CASE("of the older format numbers are read, and sentences are kept as they stand") {
  const Diagnosis d = diagnosis_from_json(old_file);
  CHECK(d.verdict == Verdict::Unknown);
  REQUIRE(d.where.size() == 1);
  REQUIRE(d.where[0].depends_on.size() == 1);
  const Dependence& depends = d.where[0].depends_on[0];
  CHECK(depends.variable == Variable{VariableKind::JointSpeed, 2});
  CHECK(depends.shape == Shape::Described);
  CHECK(depends.note == "changes sign with qd2, below 0.1 rad/s");
  CHECK(depends.sign_joint == 0);
  CHECK_FALSE(depends.upper);
  REQUIRE(d.causes.size() == 1);
  REQUIRE(d.causes[0].parameters.size() == 2);
  CHECK(d.causes[0].parameters[0].value.size() == 16);
  CHECK(d.causes[0].parameters[0].value[3] == 0.1);
  CHECK(d.causes[0].parameters[1].value == std::vector<double>{0.5});
  CHECK(std::isnan(d.causes[0].parameters[1].std[0]));
  CHECK(d.causes[0].explained_fraction == 0.5);
  CHECK(d.unexplained[0].target == "joint2");
  CHECK(std::isnan(d.unexplained[0].gap));
  CHECK(d.reduction.before_ci.high == 10.0);
  CHECK(d.reduction.columns[0].after == 1.0);
  CHECK(d.joint_names == std::vector<std::string>{"", "elbow"});
  CHECK(d.next_experiment.separates == std::vector<EffectName>{{"stribeck_friction", "joint2"}, {"payload", "tool"}});
  CHECK(experiment_text(d.next_experiment) == "run the motion faster");
  CHECK(reason_text(d.nearest[0]) == "it fits the check experiments worse");
  CHECK(reason_text(d.not_tried[0]) == "the cell has no tool");
  CHECK(d.noise.empty());
  REQUIRE(d.notes.size() == 1);
  CHECK(warnings(d)[0].starts_with("noise of current is 1.10"));
  CHECK(limit_text(d.scope[0]) == "motion-1 commands no motion");
  CHECK(to_json(diagnosis_from_json(to_json(d))) == to_json(d));
}

TEST_CASE("what is no diagnosis is refused with line and field") {
  const auto refused = [](const std::string& text, const std::string& why) {
    CHECK_THROWS_WITH(diagnosis_from_json(text, "gap.json"), Catch::StartsWith("gap.json") && Catch::Contains(why));
  };
  refused("{}", "kr5-gap/2 or kr5-gap/1");
  refused("[1, 2]", "kr5-gap/2 or kr5-gap/1");
  refused(R"({"format": "kr5-gap/9"})", "'kr5-gap/9'");
  refused(R"({"format": "kr5-gap/2"})", "verdict");
  refused(replaced(old_file, "\"unknown\"", "\"fine\""), "no_gap | explained | partly_explained | unknown");
  refused(replaced(old_file, "\"gap\": 7.0", "\"gap\": \"wide\""), "where[0].gap");
  refused(replaced(old_file, "[7.0, 1.0]", "[7.0]"), "shrink.columns.motion.i2");
  refused(replaced(to_json(full()), "\"oscillates\"", "\"wobbles\""), "where[0].depends_on[1].shape");
  refused(replaced(to_json(full()), "\"spikes\": 22", "\"spikes\": 2.5"), "spikes");
}

}  // namespace diagnosis_test
