#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/gap/notes.hpp>
#include <kr5/gap/sentences.hpp>
#include <kr5/gap/words.hpp>

namespace sentences_test {

using namespace kr5::gap;
using kr5::cell::Kind;

namespace {

Cause friction(int joint, double probability = 0.97) {
  return {{"viscous_friction", "joint" + std::to_string(joint)},
          probability,
          {{"viscous", {31.25}, {0.012}, "N.m.s/rad"}},
          0.98,
          {}};
}

Diagnosis explained(int causes) {
  Diagnosis d;
  d.verdict = Verdict::Explained;
  d.where = {{"motion", "i2", "joint2", 7.0, 0.6, {}}, {"poses", "z", "tool", 12.0, 0.4, {}}};
  for (int k = 1; k <= causes; ++k) d.causes.push_back(friction(k));
  d.reduction.before = 9.4;
  d.reduction.after = 1.02;
  return d;
}

std::string first_sentence(const std::string& text) { return text.substr(0, text.find(". ")); }

int words_of(const std::string& text) {
  std::istringstream in(text);
  int count = 0;
  for (std::string word; in >> word; ++count) {
  }
  return count;
}

}  // namespace

TEST_CASE("a verdict begins with the causes, in at most 40 words, however many there are") {
  for (const int count : {1, 2, 3, 4, 7}) {
    Diagnosis d = explained(count);
    d.joint_names = {"shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"};
    for (const char* target : {"fx", "ty"}) {
      const std::string text = first_sentence(verdict_text(d));
      CAPTURE(text);
      CHECK(text.starts_with(d.causes.size() == 1 ? "Cause: viscous friction of joint 1" : "Causes: viscous friction"));
      CHECK(words_of(text) <= 40);
      d.causes.push_back({{"ft_bias", target}, 0.7, {{"offset", {1.0}, {0.1}, "N or N.m"}}, 0.1, {}});
    }
  }
  Diagnosis pair = explained(0);
  for (const char* effect : {"link_com", "link_inertia"})
    pair.causes.push_back(
        {{effect, "joint3"}, 0.9996, {{"com", {0.01, 0.02, 0.03}, {1e-3, 2e-3, 3e-3}, "m"}}, 0.5, {}});
  CHECK(first_sentence(verdict_text(pair)) ==
        "Causes: centre of mass of the link of joint 3 and link inertia of joint 3, each more than 99.9 % probable");
}

TEST_CASE("a headline has at most 40 words, and the details say the rest") {
  for (const int count : {0, 1, 2, 7})
    for (const auto verdict : {Verdict::Explained, Verdict::PartlyExplained, Verdict::Unknown, Verdict::NoGap})
      for (const bool late : {false, true}) {
        Diagnosis d = explained(count);
        d.verdict = verdict;
        d.scope = {{ScopeReason::AtRest, Kind::Motion, "motion-1", 500}};
        if (late) d.clock_faults = {{"wrench", {Kind::Press, Kind::Profile}, -0.0065, 0.00025}};
        CAPTURE(headline_text(d), details_text(d));
        CHECK(words_of(headline_text(d)) <= 40);
        const std::string gap = details_text(d).empty() ? "" : " ";
        CHECK(headline_text(d) + gap + details_text(d) == verdict_text(d));
      }
  const Diagnosis one = explained(1);
  CHECK(headline_text(one).starts_with(causes_text(one) + " With it the gap falls from"));
  Diagnosis agreed;
  CHECK(headline_text(agreed) == verdict_text(agreed));
  CHECK(details_text(agreed).empty());
}

TEST_CASE("of one cause size, uncertainty and probability are told, of many the least probability") {
  CHECK(causes_text(explained(1)) == "Cause: viscous friction of joint 1 (31.250 ± 0.012 N m s/rad, 97 % probable).");
  Diagnosis several = explained(3);
  several.causes[1].probability = 0.62;
  CHECK(causes_text(several) == "Causes: viscous friction of joints 1, 2 and 3, each at least 62 % probable.");
  for (Cause& cause : several.causes) cause.probability = 0.999;
  CHECK(causes_text(several) == "Causes: viscous friction of joints 1, 2 and 3, each more than 99 % probable.");
  CHECK(causes_text(explained(0)).empty());
  Diagnosis many = explained(1);
  for (const char* effect : {"backlash", "coulomb_friction", "encoder_offset", "payload"})
    many.causes.push_back({{effect, "joint1"}, 0.9, {}, 0.1, {}});
  CHECK(causes_text(many).find("and 2 more (listed below), each at least 90 % probable.") != std::string::npos);
}

TEST_CASE("the reduction, ties and what remains follow the causes") {
  Diagnosis d = explained(1);
  d.causes[0].tied_with = {{"coulomb_friction", "joint1"}};
  std::string text = verdict_text(d);
  CHECK(
      text.find("With it the gap falls from 9.40 to 1.02 times the noise on experiments not used to fit; no structure "
                "is left in the residuals.") != std::string::npos);
  CHECK(text.find("This recording cannot distinguish it from Coulomb friction of joint 1.") != std::string::npos);
  d.reduction.after = 2.5;
  CHECK(verdict_text(d).find("what is left is within the accuracy of a simulation.") != std::string::npos);
  d.verdict = Verdict::PartlyExplained;
  Dependence grows{{VariableKind::JointPosition, 4}, Shape::Grows};
  d.unexplained = {d.where[1]};
  d.unexplained[0].depends_on = {grows};
  text = verdict_text(d);
  CHECK(text.find("structure remains in the residuals of the position z of the tool; it grows with the position of "
                  "joint 4.") != std::string::npos);
}

TEST_CASE("where a gap is, is told of one column, or by shares") {
  Diagnosis d = explained(1);
  CHECK(location_text(d.where) ==
        "60 % of the excess sits in the current of joint 2 (7.00 times the noise) and 40 % in the position z of the "
        "tool (12.0 times the noise).");
  d.where[0].share = 0.99;
  d.where[1].share = 0.01;
  d.where[0].depends_on = {{{VariableKind::JointSpeed, 2}, Shape::Offset, 2}};
  CHECK(location_text(d.where) ==
        "Only the current of joint 2 disagrees clearly: 7.00 times the noise; its gap changes sign with "
        "the direction of motion, and is of the same size at any speed of joint 2.");
  d.where = {{"press", "fy", "fy", 15.1, 0.34, {}},
             {"motion", "fy", "fy", 15.0, 0.33, {}},
             {"profile", "fy", "fy", 15.0, 0.33, {}}};
  CHECK(location_text(d.where).find("the force y at the wrist, in presses on the bench, free motion and rolls of the "
                                    "peg on the tube") != std::string::npos);
  CHECK(location_text({}).empty());
}

TEST_CASE("without a cause the gap is told, and late columns before it") {
  Diagnosis d = explained(0);
  d.verdict = Verdict::Unknown;
  CHECK(
      verdict_text(d).starts_with("No effect of the catalogue explains the gap of 9.40 times the noise, so no cause"));
  d.clock_faults = {{"torques", {Kind::Motion}, 0.0316, 0.0002}};
  CHECK(verdict_text(d).starts_with(
      "The joint torques were logged 31.60 ± 0.20 ms late relative to the other columns. No effect of the catalogue "
      "explains the gap of 9.40 times the noise with these times as they are"));
  Diagnosis broken = explained(1);
  broken.clock_faults = {{"wrench", {Kind::Press, Kind::Profile}, -0.0065, 0.00025}};
  CHECK(verdict_text(broken).starts_with(
      "Cause: viscous friction of joint 1 (31.250 ± 0.012 N m s/rad, 97 % probable). The wrench of contact was logged "
      "6.50 ± 0.25 ms early relative to the other columns. With it the gap falls"));
}

TEST_CASE("that there is no gap is claimed within what was compared") {
  Diagnosis d;
  CHECK(verdict_text(d) == "There is no gap: simulation and recording agree within noise. No correction is needed.");
  d.scope = {{ScopeReason::AtRest, Kind::Motion, "motion-1", 500}};
  CHECK(verdict_text(d) ==
        "Within what the recording can show there is no gap: simulation and recording agree within noise. The rest of "
        "the cell was not tested. Motion-1 commands no motion: it cannot show friction, inertia and servos.");
  d.scope.clear();
  d.reduction.before = 1.6;
  CHECK(verdict_text(d) == "Simulation and recording agree within 1.6 times the noise.");
  d.excused = {{"motion.tau1", 0.1}};
  CHECK(verdict_text(d).ends_with("1.6 times the noise, which even a freely fitted arm leaves."));
}

TEST_CASE("dependences have words") {
  const auto said = [](VariableKind kind, Shape shape, int joint = 0, const std::string& column = "", int sign = 0) {
    Dependence d{{kind, joint, column}, shape, sign};
    d.lower = 0.1;
    d.upper = 0.25;
    d.unit = "rad or m";
    d.period = 0.6981;
    d.effect = {"coulomb_friction", "joint3"};
    if (shape == Shape::Below) d.lower.reset();
    if (shape == Shape::Above) d.upper.reset();
    return dependence_text(d);
  };
  using enum VariableKind;
  CHECK(said(JointVelocity, Shape::Below, 3) == "is largest where the velocity of joint 3 is below 0.25 rad");
  CHECK(said(JointPosition, Shape::Above, 3) == "is largest where the position of joint 3 is above 0.1 rad");
  CHECK(said(JointAcceleration, Shape::Between, 3) ==
        "is largest where the acceleration of joint 3 is between 0.1 rad and 0.25 rad");
  CHECK(said(JointSpeed, Shape::Varies, 3, "", 3) ==
        "changes sign with the direction of motion and varies with the speed of joint 3");
  CHECK(said(Column, Shape::Grows, 0, "t") == "grows with the time");
  CHECK(said(Column, Shape::Offset, 0, "t") == "is a constant offset");
  CHECK(said(Prediction, Shape::Falls, 0, "i3") == "falls with the simulated current of joint 3");
  CHECK(said(PathVelocity, Shape::Grows) == "grows with the commanded vertical speed");
  CHECK(said(Column, Shape::Drifts, 0, "t") == "drifts slowly");
  CHECK(said(Column, Shape::Oscillates, 0, "t") == "oscillates with a period of 0.698 s");
  CHECK(said(JointPosition, Shape::EffectDiffers, 3) ==
        "suggests that Coulomb friction of joint 3 differs with the position of joint 3");
  CHECK(said(WhichColumn, Shape::EffectDiffers) == "suggests that Coulomb friction of joint 3 differs between columns");
  CHECK(dependence_text({{Prediction, 0, "z"}, Shape::Grows}, "scan") ==
        "grows with the simulated range of the scanner");
  Dependence old{{JointSpeed, 2}, Shape::Described};
  old.note = "below 0.1 rad/s";
  CHECK(dependence_text(old) == "depends on the speed of joint 2 (below 0.1 rad/s)");
}

TEST_CASE("notes tell what a recording is like, and what that means") {
  Diagnosis d;
  d.noise = {{"force", Kind::Press, 0.7, 0.02}, {"pose_position", std::nullopt, 1.5, 0.011}};
  d.spikes = 1;
  d.excused = {{"motion.tau1", 0.1}, {"motion.tau2", 0.1}};
  d.effects_limit = 6;
  const auto all = notes(d);
  REQUIRE(all.size() == 4);
  CHECK(all[0].text ==
        "Even a freely fitted arm leaves an error in 2 columns; that part is not attributed to a cause, "
        "and gaps are relative to the sensor noise alone.");
  CHECK(all[1].text == "1 sample is a spike and was left out.");
  CHECK_FALSE(all[1].meaning.empty());
  CHECK(all[2].text.find("max_effects: 6") != std::string::npos);
  CHECK(all[3].text ==
        "The measured noise differs from the declared one by these factors: force in press 0.70 ± 0.02 "
        "and pose position 1.50 ± 0.01.");
  CHECK(notes(d, false)[3].text.find("that of neighbouring rows") != std::string::npos);
  CHECK(warnings(d).size() == 4);
  d.nuisance_std = 0.004;  // how to read a result is no warning
  CHECK(warnings(d).size() == 4);
  CHECK(notes(d).back().text.find("uncertain by about 0.4 %, friction by 0.8 %") != std::string::npos);
  d.nuisance_std = 0.0;
  d.clock_faults = {{"positions", {Kind::Motion}, 0.002, 0.0001}};
  CHECK(warnings(d).front() == "The joint angles were logged 2.00 ± 0.10 ms late relative to the other columns.");
  CHECK(notes(d).size() == 4);
}

TEST_CASE("columns, parts, targets and joints have names") {
  struct Named {
    const char *group, *words, *part;
  };
  for (const Named& column : {Named{"motion.i3", "current of joint 3", "joint3"},
                              {"motion.tz", "torque about z at the wrist", "sensor"},
                              {"poses.rx", "orientation of the tool about x", "tool"},
                              {"press.fz", "force z while pressing", "contact"},
                              {"scan.z", "range of the scanner", "laser"},
                              {"motion.nothing", "motion.nothing", "motion.nothing"}}) {
    CHECK(column_text(column.group) == column.words);
    CHECK(part_of(column.group) == column.part);
  }
  CHECK(part_text("joint3") == "joint 3");
  CHECK(target_text("fx") == "force x");
  CHECK(effects_text("viscous_friction", {"joint1", "joint2", "joint3"}) == "viscous friction of joints 1, 2 and 3");
  CHECK(display_unit("N or N.m", {1.0}, "fx").second == "N");
  CHECK(display_unit("N or N.m", {1.0}, "tz").second == "N m");
  const std::vector<std::string> names = {"A1", "joint3", "elbow", "joint_4"};
  CHECK(joint_name(names, "joint1").empty());
  CHECK(joint_name(names, "joint2") == "joint3");
  CHECK(joint_name(names, "joint3") == "elbow");
  CHECK(joint_name(names, "joint4").empty());
  CHECK(joint_name(names, "joint5").empty());
  CHECK(joint_name(names, "fx").empty());
}

TEST_CASE("values have as many digits as their uncertainty, and one uncertainty where it is common") {
  CHECK(value_text({"a", {0.01, 0.02, 0.03}, {0.001, 0.001, 0.004}, "m"}, "joint3") ==
        "10.0 ± 1.0, 20.0 ± 1.0, 30.0 ± 4.0 mm");
  CHECK(value_text({"a", {0.01, 0.02, 0.03}, {0.001, 0.001, 0.001}, "m"}, "joint3") == "10.0, 20.0, 30.0 ± 1.0 mm");
  CHECK(value_text({"cycles", {1.0}, {0.0}, "-"}, "joint3") == "1");
  CHECK(value_text({"time_constant", {250.0}, {12.0}, "s"}, "joint3") == "250 ± 12 s");
  CHECK(value_text({"delay", {0.0125}, {0.0004}, "s"}, "joint3") == "12.50 ± 0.40 ms");
}

}  // namespace sentences_test
