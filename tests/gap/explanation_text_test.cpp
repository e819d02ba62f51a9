#include <kr5/gap/explanation_text.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

namespace explanation_text_test {

using namespace kr5;
using namespace kr5::gap;
using Catch::Contains;
using Texts = std::vector<std::string>;

namespace {

Cause friction(int joint) {
  return {{"coulomb_friction", "joint" + std::to_string(joint)}, 0.97, {{"coulomb", {25.0}, {0.1}, "N.m"}}, 0.62, {}};
}

/// One cause that explains one column, in two experiments.
DiagnosisEvidence evidence() {
  DiagnosisEvidence out;
  out.columns = {{"motion.i2", {"motion-2"}, 100, 7.0, 1.1}, {"motion.i3", {"motion-2"}, 100, 1.4, 1.1}};
  out.causes = {{{{"motion.i2", 7.0, 1.02, 1.1, 0.9}, {"motion.i3", 1.4, 1.3, 1.1, 0.005}},
                 {{"motion-1", 0.93}, {"motion-2", 0.88}},
                 42.4}};
  out.held_out = true;
  return out;
}

Diagnosis blaming(int causes) {
  Diagnosis d;
  d.verdict = Verdict::Explained;
  for (int k = 1; k <= causes; ++k) d.causes.push_back(friction(k));
  return d;
}

}  // namespace

TEST_CASE("what speaks for a cause stands with its numbers") {
  const DiagnosisEvidence told = evidence();
  CHECK(cause_reasons(blaming(1), 0, &told).in_favour ==
        Texts{"It explains 62 % of the excess, on experiments that were not used for the fit.",
              "It explains the current of joint 2 (7.00 → 1.02).",
              "It is consistent in each of the 2 experiments in which it stands out: in the worst 88 % of its excess "
              "goes.",
              "Its size differs from zero by 42 standard deviations."});
  CHECK(cause_reasons(blaming(2), 1).in_favour ==
        Texts{"It explains 62 % of the excess not explained by the other causes, on experiments that were not used for "
              "the fit."});
  CHECK_THROWS_WITH(cause_reasons(blaming(1), 1), Contains("1 causes, none of number 1"));
}

TEST_CASE("columns that one cause explains alike are told together, and the largest sizes without their number") {
  DiagnosisEvidence told = evidence();
  told.causes[0].columns[1] = {"motion.i3", 5.0, 1.0, 1.1, 0.1};
  told.causes[0].deviations = 12345.6;
  const Texts reasons = cause_reasons(blaming(1), 0, &told).in_favour;
  CHECK(reasons[1] ==
        "It explains the current of joint 2 (7.00 → 1.02) and the current of joint 3 (5.00 → 1.00), all with the same "
        "values.");
  CHECK(reasons[3] == "Its size differs from zero by more than 1000 standard deviations.");
}

TEST_CASE("what speaks against a cause is told, and that nothing does") {
  Diagnosis d = blaming(1);
  d.causes[0].probability = 0.995;
  DiagnosisEvidence told = evidence();
  CHECK(cause_reasons(d, 0, &told).against ==
        Texts{"No evidence against it: no column gets worse, and no structure remains in those that it explains."});
  CHECK(cause_reasons(d, 0).against == Texts{"The file contains no evidence against it."});

  d.causes[0].probability = 0.7;
  d.causes[0].tied_with = {{"stribeck_friction", "joint2"}};
  d.unexplained = {{"motion", "i2", "joint2", 1.6, 1.0, {{.variable = find_variable("q2"), .shape = Shape::Grows}}},
                   {"motion", "i3", "joint3", 1.3, 0.1, {}}};  // which it does not explain
  told.causes[0].columns.push_back({"motion.i4", 1.5, 2.0, 1.1, -0.1});
  told.causes[0].experiments[1].closed = 0.3;
  told.causes[0].deviations = 2.04;
  CHECK(cause_reasons(d, 0, &told).against ==
        Texts{"Stribeck friction of joint 2 would look the same in this recording.",
              "30 % of the probability lies with other explanations.",
              "In the current of joint 2 a gap of 1.60 stays, and grows with the position of joint 2.",
              "It makes the current of joint 4 worse (1.50 → 2.00).", "In motion-2 it explains 30 % of the excess.",
              "Its size differs from zero by only 2.0 standard deviations."});
}

TEST_CASE("rivals are told by what they leave, and those that explain nothing are not told") {
  EffectFit near{{"stribeck_friction", "joint2"}, "", {}, 0.4, {{"motion.i2", 7.0, 3.2}, {"motion.i3", 1.4, 1.3}}};
  EffectFit full{{"backlash", "joint2"}, "", {}, 0.9, {{"motion.i2", 7.0, 1.05}}};
  EffectFit none{{"payload", "tool"}, "", {}, 0.001, {{"motion.i2", 7.0, 7.0}}};
  CHECK(rival_texts({near, full, none}, evidence()) ==
        Texts{"Stribeck friction of joint 2 explains 40 % and leaves the current of joint 2 at 3.20.",
              "Backlash of joint 2 explains 90 % and leaves no column above the floor."});
  CHECK(rival_texts({none}, evidence()) ==
        Texts{"No other effect explains more than 1 % of the part that it explains."});
}

TEST_CASE("an effect that was fitted is weighed by the excess, its columns and the diagnosis") {
  const EffectName name{"stribeck_friction", "joint2"};
  const EffectFit fit{name, "", {}, 0.4, {{"motion.i2", 7.0, 3.2}, {"motion.i3", 1.4, 1.6}, {"motion.i1", 3.0, 3.0}}};
  DiagnosisEvidence told = evidence();
  told.columns.push_back({"motion.i1", {}, 100, 3.0, 1.1});
  const Reasons reasons = trial_reasons({name, fit, EffectName(friction(2))}, blaming(2), told);
  CHECK(reasons.in_favour == Texts{"Fitted in place of Coulomb friction of joint 2, it explains 40 % of the excess, on "
                                   "experiments not used for the fit.",
                                   "Better with it: the current of joint 2 (7.00 → 3.20)."});
  CHECK(
      reasons.against ==
      Texts{"Remaining gap: the current of joint 2 at 3.20, the current of joint 1 at 3.00 and the current of joint 3 "
            "at 1.60; 1 is the floor.",
            "Worse with it: the current of joint 3 (1.40 → 1.60).",
            "The diagnosis names Coulomb friction of joint 1 and Coulomb friction of joint 2, not this."});

  CHECK(trial_reasons({name, {}, {}}, blaming(1), told).against ==
        Texts{"It changes no recorded column; this recording contains no evidence about it."});
  EffectFit nothing = fit;
  nothing.explained_fraction = 0.0;
  nothing.columns.clear();
  CHECK(trial_reasons({name, nothing, {}}, blaming(0), told).against == Texts{"There is no gap to explain."});
  nothing.columns = {{"motion.i2", 7.0, 7.0}};
  CHECK(trial_reasons({name, nothing, {}}, blaming(0), told).against.front() ==
        "Fitted at its best values, it explains less than 1 % of the excess.");
}

TEST_CASE("an effect that the diagnosis blames is told with its probability") {
  const EffectFit fit{friction(1), "", {}, 0.9, {{"motion.i2", 7.0, 1.0}}};
  const Reasons reasons = trial_reasons({friction(1), fit, {}}, blaming(1), evidence());
  CHECK(reasons.in_favour.back() == "The diagnosis names it as a cause, with a probability of 97 %.");
  CHECK(reasons.against.empty());
}

TEST_CASE("the floor of a recording is the RMS of its columns") {
  CHECK(floor_text({{"motion.i1", {}, 9, 0.6, 1.1}, {"motion.i2", {}, 9, 0.8, 1.1}}) ==
        "Over its 2 columns the gap is 0.71 times the noise, and 1 is the floor.");
  CHECK(floor_text({}).empty());
}

TEST_CASE("causes of unusual size doubt the model or the zeros of the log") {
  const std::vector<ModelWarning> warnings = {
      {{"link_mass", "joint2"}, ModelWarningKind::Mass, 2.13, 0.1, "-"},
      {{"link_com", "joint3"}, ModelWarningKind::Size, 0.1534, 0.011, "m"},
      {{"encoder_offset", "joint1"}, ModelWarningKind::Zero, -0.2, 0.01, "rad"}};
  const Texts told = model_warning_texts(warnings, {"base", "shoulder", "elbow"}, "arm.urdf");
  REQUIRE(told.size() == 2);
  CHECK_THAT(told[0], Contains("Does arm.urdf describe this robot and its payload?") &&
                          Contains("(shoulder; 2.1 times that of the model)") &&
                          Contains("(elbow; 153 mm from that of the model) differ by more than is usual."));
  CHECK_THAT(told[1], Contains("Does the log measure base from the same zero as the model?") &&
                          Contains("corrects the log, by -0.2 rad."));
  CHECK(model_warning_texts({}, {}).empty());
}

}  // namespace explanation_text_test
