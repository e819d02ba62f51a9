#include "gap/stages/report_stage.hpp"

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include "gap/diagnosis_matchers.hpp"
#include "gap/staged.hpp"

/// @file
/// The diagnosis that is made of what the stages found.

namespace report_stage_test {

using namespace kr5;
using namespace staged;

namespace {

gap::Diagnosis report(const Stages& s, const gap::JudgeOutput& judged) {
  return gap::report_stage(s.compared, s.noise, s.screened, judged, s.options);
}

}  // namespace

TEST_CASE("the report holds verdict, causes and figures of the judgement") {
  const Stages s(Recorded{.of_wave = 8.0, .of_square = 1.5}.recording());
  const gap::JudgeOutput judged = s.judged();
  const gap::Diagnosis d = report(s, judged);
  CHECK(d.verdict == gap::Verdict::PartlyExplained);
  CHECK(test::names_only(d, {{"wave", "i1"}}));
  REQUIRE(d.where.size() == 2);
  REQUIRE(d.unexplained.size() == 1);
  CHECK(d.unexplained[0].column == "i2");
  CHECK(d.reduction.before > d.reduction.after);
  CHECK(d.nuisance_std == 0.0);
  REQUIRE(d.scope.size() == 1);
  CHECK(d.scope[0].reason == gap::ScopeReason::OneKind);
  CHECK(std::ranges::any_of(d.not_tried, [](const gap::UntriedEffect& e) { return e.effect == "coulomb_friction"; }));
  CHECK(d.next_experiment.what.empty());
}

TEST_CASE("without a cause nothing is said to fall, and without a gap nothing is said to lie anywhere") {
  const Stages unknown(Recorded{.of_square = 1.5}.recording());
  const gap::Diagnosis d = report(unknown, unknown.judged());
  CHECK(d.verdict == gap::Verdict::Unknown);
  CHECK(d.reduction.after == d.reduction.before);
  CHECK(d.where.size() == 1);
  const Stages none(Recorded{}.recording());
  const gap::Diagnosis sound = report(none, none.judged());
  CHECK(sound.verdict == gap::Verdict::NoGap);
  CHECK(sound.where.empty());
  CHECK(sound.nearest.empty());
}

TEST_CASE("whatever a stage noticed is in the report") {
  Stages s(Recorded{.of_wave = 8.0, .check = false}.recording());
  gap::JudgeOutput judged = s.judged();
  const gap::Diagnosis quiet = report(s, judged);
  REQUIRE(quiet.missing_splits.size() == 1);
  CHECK(quiet.missing_splits[0].split == cell::Split::Check);
  CHECK(quiet.spikes == 0);
  CHECK(quiet.outliers == 0);
  CHECK(quiet.noise.empty());
  CHECK(quiet.sets_limit == 0);
  CHECK(quiet.effects_limit == 0);
  s.noise.corrected = {{"current", cell::Kind::Motion, 1.234, 0.05, 100}};
  s.screened.pose_noise = {{"pose_position", {}, 0.5, 0.02, 100}};
  s.noise.coarse = {{"motion-1", "i2"}};
  s.noise.excused = {{"motion.i1", 0.3}};
  s.noise.spikes = 3;
  s.screened.stray_poses = 2;
  judged.late_spikes = 1;
  judged.found.cut_short = true;
  judged.clock_faults = {{"wrench", {cell::Kind::Motion}, -0.012, 0.001}};
  s.options.max_effects = 1;
  const gap::Diagnosis d = report(s, judged);
  REQUIRE(d.noise.size() == 2);
  CHECK(d.noise[0].ratio == 1.234);
  CHECK(d.noise[1].key == "pose_position");
  REQUIRE(d.coarse.size() == 1);
  CHECK(d.coarse[0].column == "i2");
  REQUIRE(d.excused.size() == 1);
  CHECK(d.excused[0].error == 0.3);
  CHECK(d.spikes == 5);
  CHECK(d.outliers == 1);
  CHECK(d.sets_limit == 20);
  CHECK(d.effects_limit == 1);
  REQUIRE(d.clock_faults.size() == 1);
  CHECK(d.clock_faults[0].delay == -0.012);
}

}  // namespace report_stage_test
