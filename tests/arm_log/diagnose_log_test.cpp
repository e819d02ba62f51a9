#include <kr5/arm_log/diagnose_log.hpp>

#include <catch2/catch.hpp>

#include <kr5/arm_log/read_log.hpp>
#include <kr5/cell/import_urdf.hpp>
#include <kr5/core/error.hpp>

#include "arm_log/logged_arm.hpp"
#include "gap/diagnosis_matchers.hpp"

namespace diagnose_log_test {

using namespace kr5;
using namespace kr5::test;

TEST_CASE("a log of an arm that is as its model says has no gap") {
  const arm_log::LogDiagnosis found = arm_log::diagnose_log(logged(moved_arm()), described_arm());
  INFO(text(found.diagnosis));
  CHECK(found.diagnosis.verdict == gap::Verdict::NoGap);
  CHECK(found.diagnosis.causes.empty());
}

TEST_CASE("dry friction of a joint, of which the model says nothing, is named with its size") {
  cell::Cell arm = moved_arm();
  arm.drives->friction.coulomb[1] = 2.5;
  const arm_log::LogDiagnosis found = arm_log::diagnose_log(logged(arm), described_arm());
  INFO(text(found.diagnosis));
  CHECK(found.diagnosis.verdict == gap::Verdict::Explained);
  CHECK(names_only(found.diagnosis, {{"coulomb_friction", "joint2"}}));
  CHECK(found.diagnosis.cell.effects.number("coulomb_friction", "coulomb", 1) == Approx(2.5).epsilon(0.1));
}

TEST_CASE("dry friction is named in a log whose efforts are rounded to half of it") {
  cell::Cell arm = moved_arm();
  arm.drives->friction.coulomb[1] = 4.0;
  arm_log::ArmLog log = logged(arm);
  log.effort = 2.0 * (log.effort / 2.0).array().round();
  const arm_log::LogDiagnosis found = arm_log::diagnose_log(log, described_arm());
  INFO(text(found.diagnosis));
  CHECK(names_only(found.diagnosis, {{"coulomb_friction", "joint2"}}));
  CHECK(found.diagnosis.cell.effects.number("coulomb_friction", "coulomb", 1) == Approx(4.0).epsilon(0.1));
}

TEST_CASE("the log that ships is diagnosed against its description") {
  const std::filesystem::path folder = std::filesystem::path(KR5_SHARE_DIR) / "data/arm_log";
  const cell::Cell model = cell::import_urdf(folder / "arm.urdf").cell;
  const arm_log::LogDiagnosis found =
      arm_log::diagnose_log(arm_log::read_log(folder / "joint_states.csv", model), model);
  INFO(text(found.diagnosis));
  CHECK(names_only(found.diagnosis, {{"coulomb_friction", "joint3"}}));
  CHECK(found.diagnosis.cell.effects.number("coulomb_friction", "coulomb", 2) == Approx(9.0).epsilon(0.05));
}

TEST_CASE("the recording of a log gives the diagnosis of the log") {
  cell::Cell arm = moved_arm();
  arm.drives->friction.coulomb[1] = 2.5;
  const arm_log::LogDiagnosis found = arm_log::diagnose_log(logged(arm), described_arm());
  const gap::Diagnosis again = arm_log::diagnose(found.recording, predict::FastSimulator());
  REQUIRE(again.causes.size() == found.diagnosis.causes.size());
  CHECK(again.causes[0].effect == found.diagnosis.causes[0].effect);
  CHECK(again.causes[0].probability == found.diagnosis.causes[0].probability);
  CHECK(again.reduction.after == found.diagnosis.reduction.after);
}

TEST_CASE("a log of another arm is refused before anything is estimated") {
  CHECK_THROWS_AS(arm_log::diagnose_log(logged(moved_arm()), arm_cell({"rrrr"})), InvalidArgument);
  arm_log::LogDiagnosisOptions options;
  options.search.beam = 0;
  CHECK_THROWS_AS(arm_log::diagnose_log(logged(moved_arm()), described_arm(), options), InvalidArgument);
}

}  // namespace diagnose_log_test
