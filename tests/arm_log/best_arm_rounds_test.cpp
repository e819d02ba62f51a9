#include "arm_log/best_arm_rounds.hpp"

#include <catch2/catch.hpp>

#include <kr5/arm_log/diagnose_log.hpp>
#include <kr5/cell/effect.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "arm_log/logged_arm.hpp"
#include "gap/diagnosis_matchers.hpp"

namespace best_arm_rounds_test {

using namespace kr5;
using namespace kr5::test;

namespace {

/// A base that is not level, which no masses and no friction of an arm can show.
cell::Cell tilted_arm() {
  cell::Cell out = moved_arm();
  cell::set_effect(out, "base_tilt", "base", "roll", 0.02);
  cell::set_effect(out, "base_tilt", "base", "pitch", -0.03);
  return out;
}

}  // namespace

TEST_CASE("less the share of a cause, the best arm leaves what it leaves without that cause") {
  const arm_log::ArmLog log = logged(tilted_arm());
  cell::Recording recording = arm_log::prepare_log(log, described_arm()).recording;
  cell::Cell tuned = recording.cell;
  cell::set_effect(tuned, "base_tilt", "base", "roll", 0.02);
  cell::set_effect(tuned, "base_tilt", "base", "pitch", -0.03);
  const predict::FastSimulator simulator;
  const arm_log::BestArmErrors before = arm_log::best_arm_errors(recording);
  const arm_log::BestArmErrors after = arm_log::best_arm_errors(arm_log::without_causes(recording, simulator, tuned));
  const arm_log::BestArmErrors sound =
      arm_log::best_arm_errors(arm_log::prepare_log(logged(moved_arm()), described_arm()).recording);
  CHECK(arm_log::lessens(before, after));
  CHECK_FALSE(arm_log::lessens(after, sound));
  for (std::size_t k = 0; k < 3; ++k) CHECK(after.errors[k].error == Approx(sound.errors[k].error).epsilon(0.3));
}

TEST_CASE("a small friction beside a tilted base is found, although no arm can have the tilt") {
  cell::Cell arm = tilted_arm();
  arm.drives->friction.coulomb[0] = 0.3;
  const arm_log::LogDiagnosis found = arm_log::diagnose_log(logged(arm), described_arm());
  INFO(text(found.diagnosis));
  CHECK(found.diagnosis.verdict == gap::Verdict::Explained);
  CHECK(names_only(found.diagnosis, {{"base_tilt", "base"}, {"coulomb_friction", "joint1"}}));
  CHECK(found.diagnosis.cell.effects.number("coulomb_friction", "coulomb", 0) == Approx(0.3).epsilon(0.2));
}

TEST_CASE("an experiment that the simulator refuses stays as it is") {
  cell::Recording recording = arm_log::prepare_log(logged(moved_arm()), described_arm()).recording;
  cell::Cell impossible = recording.cell;
  impossible.robot.links.clear();
  const cell::Recording left = arm_log::without_causes(recording, predict::FastSimulator(), impossible);
  CHECK(left.experiments[0].data.values == recording.experiments[0].data.values);
}

}  // namespace best_arm_rounds_test
