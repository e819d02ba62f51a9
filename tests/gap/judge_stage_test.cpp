#include "gap/stages/judge_stage.hpp"

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include "gap/fitting/posterior.hpp"
#include "gap/staged.hpp"

/// @file
/// What is blamed, of models whose truth is known.

namespace judge_stage_test {

using namespace kr5;
using namespace staged;

TEST_CASE("an effect that is there is blamed, with its size and what it explains") {
  const Stages s(Recorded{.of_wave = 8.0}.recording());
  const gap::JudgeOutput out = s.judged();
  CHECK(out.verdict == gap::Verdict::Explained);
  REQUIRE(out.causes.size() == 1);
  const gap::Cause& cause = out.causes[0];
  CHECK(cause.effect == "wave");
  CHECK(cause.target == "i1");
  CHECK(cause.probability > 0.9);
  CHECK(cause.tied_with.empty());
  CHECK(std::abs(cause.parameters[0].value[0] - 8.0) < 4 * cause.parameters[0].std[0]);
  CHECK(cause.explained_fraction > 0.9);
  CHECK(out.above == std::vector<bool>{true, false});
  CHECK(out.before.structured == std::vector<bool>{true, false});
  CHECK_FALSE(out.after.any());
  CHECK(names(out.model.parts) == std::vector<std::string>{"wave"});
}

TEST_CASE("verdicts follow from what is blamed and what is left") {
  const auto verdict = [](const Recorded& r) { return Stages(r.recording()).judged().verdict; };
  CHECK(verdict({}) == gap::Verdict::NoGap);
  CHECK(verdict({.of_square = 1.5}) == gap::Verdict::Unknown);
  CHECK(verdict({.of_wave = 8.0, .of_square = 1.5}) == gap::Verdict::PartlyExplained);
}

TEST_CASE("effects that stand for each other are tied") {
  gap::DiagnoseOptions with = options();
  with.own_hypotheses.push_back(adding("twin", "i1", wave));
  const gap::JudgeOutput out = Stages(Recorded{.of_wave = 8.0}.recording(), with).judged();
  REQUIRE(out.causes.size() == 1);
  const gap::EffectName other{out.causes[0].effect == "wave" ? "twin" : "wave", "i1"};
  CHECK(out.causes[0].tied_with == std::vector<gap::EffectName>{other});
  CHECK(out.causes[0].probability == Approx(0.5).margin(0.1));
}

TEST_CASE("a fault of the recording is told as a clock and blamed on nothing") {
  gap::DiagnoseOptions with = options();
  gap::Hypothesis clock = adding("clock_offset", "i1", wave);
  clock.of_recording = true;
  clock.target = "motor currents";
  with.own_hypotheses = {clock};
  const gap::JudgeOutput out = Stages(Recorded{.of_wave = 8.0}.recording(), with).judged();
  CHECK(out.causes.empty());
  CHECK(out.verdict == gap::Verdict::Unknown);
  REQUIRE(out.clock_faults.size() == 1);
  CHECK(out.clock_faults[0].group == "currents");
  CHECK(std::abs(out.clock_faults[0].delay - 8.0) < 4 * out.clock_faults[0].std);
  CHECK(out.model.parts.empty());
  CHECK(out.after.structured == out.before.structured);
}

TEST_CASE("an effect that leaves much of its column is distrusted, and not blamed") {
  // A square wave in i1, to which a sine of its frequency bends: eight tenths, and a structure is left.
  cell::Recording r = Recorded{}.recording();
  for (cell::Experiment& e : r.experiments)
    e.data.values.col(e.data.find("i1")) +=
        4.0 * at_times(e, [](double t) { return std::sin(3.0 * t) > 0 ? 1.0 : -1.0; });
  const Stages s(r);
  const gap::SearchOutput found = s.searched();
  REQUIRE_FALSE(found.models.kept.front().parts.empty());  // it is the best that there is
  const gap::JudgeOutput out = s.judged();
  CHECK(out.causes.empty());
  CHECK(out.verdict == gap::Verdict::Unknown);
}

TEST_CASE("effects that make up for each other, and fit what judges worse than nothing does, are not blamed") {
  // Beyond 50 s both are large and cancel but for a fiftieth of a wave, which was not recorded.
  const auto one = [](double t) { return t < 50 ? wave(t) : 0.6; };
  const auto other = [](double t) { return t < 50 ? 0.2 * std::cos(5.0 * t) : -0.58; };
  Random random(153);
  cell::Recording r;
  r.cell = unit_noise();
  r.experiments = {motion("motion-1", cell::Split::Fit, 500), motion("motion-2", cell::Split::Check, 400, 100.0)};
  for (cell::Experiment& e : r.experiments) {
    const bool fit = e.split == cell::Split::Fit;
    add_column(
        e, "i1",
        random.normal_vector(e.data.values.rows()) + (fit ? 20.0 : 0.0) * (at_times(e, one) + at_times(e, other)));
  }
  gap::DiagnoseOptions with = options();
  with.own_hypotheses = {adding("one", "i1", one), adding("other", "i1", other)};
  const Stages s(r, with);
  REQUIRE(s.searched().models.kept.front().parts.size() == 2);
  CHECK(s.judged().causes.empty());
}

TEST_CASE("samples that deviate from the best model alone are marked late, in a copy of the data") {
  cell::Recording r = Recorded{.of_wave = 8.0}.recording();
  r.experiments[0].data.values(50, r.experiments[0].data.find("i1")) += 30.0;
  Stages s(r);
  REQUIRE(s.screened.data.use(50) == 0.0);
  s.screened.data.use(50) = 1.0;  // as if it had not been seen before
  const gap::JudgeOutput out = s.judged();
  CHECK(out.late_spikes == 1);
  CHECK(out.data.use(50) == 0.0);
  CHECK(s.screened.data.use(50) == 1.0);
}

TEST_CASE("where errors of a real arm are known, an effect must lessen a column that is unexplained without it") {
  gap::DiagnoseOptions with = options();
  with.errors_of_recording = true;
  with.simulator_errors = {{"motion.i1", 2.0}};
  // Far above the error: blamed. Within it: the data may fit, and nothing is blamed.
  CHECK(Stages(Recorded{.of_wave = 80.0}.recording(), with).judged().causes.size() == 1);
  CHECK(Stages(Recorded{.of_wave = 5.0}.recording(), with).judged().causes.empty());
}

}  // namespace judge_stage_test
