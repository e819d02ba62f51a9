#include <kr5/gap/explanation.hpp>

#include <algorithm>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "gap/protocol.hpp"

namespace explanation_test {

using namespace kr5;
using Catch::Contains;

namespace {

const predict::FastSimulator simulator;
const double usual = protocol::nominal().drives->friction.coulomb(1);

gap::Cause friction() {
  return {{"coulomb_friction", "joint2"}, 0.99, {{"coulomb", {2.0 * usual}, {0.01 * usual}, "N.m"}}, 0.9, {}};
}
gap::Cause offset() {
  return {{"tool_offset", "tool"}, 0.99, {{"offset", {2e-3, 0, 0}, {1e-4, 1e-4, 1e-4}, "m"}}, 0.5, {}};
}

/// A recording of a cell that carries these causes, and the diagnosis that names them.
struct Explained {
  cell::Recording recording;
  gap::Diagnosis found;
};

Explained explained(const std::vector<gap::Cause>& causes) {
  Random random(19);
  Explained out;
  out.recording = protocol::record(gap::with_causes(protocol::nominal(), causes), random);
  out.recording.cell = protocol::nominal();
  out.found.verdict = gap::Verdict::Explained;
  out.found.causes = causes;
  return out;
}

const gap::ColumnEvidence& of_column(const gap::CauseEvidence& evidence, const std::string& column) {
  return *std::ranges::find(evidence.columns, column, &gap::ColumnEvidence::column);
}

}  // namespace

TEST_CASE("causes are added to a cell in every form, and those of no catalogue left out") {
  const cell::Cell cell = protocol::nominal();
  gap::Cause own = friction();
  own.effect = "bent_sensor";
  const cell::Cell with = gap::with_causes(cell, {friction(), own, offset()});
  CHECK(with.effects.number("coulomb_friction", "coulomb", 1) == 2.0 * usual);
  CHECK(with.effects.vector("tool_offset", "offset") == Eigen::Vector3d(2e-3, 0, 0));

  const auto mount = std::get<Pose>(*cell::nominal_value(cell, "laser_mount", "laser", "T_E_L"));
  gap::ParameterEstimate pose = {"T_E_L", {}, {}, ""};
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) pose.value.push_back(mount.matrix()(row, column));
  const cell::Cell moved = gap::with_causes(cell, {{{"laser_mount", "laser"}, 1.0, {pose}, 0.5, {}}});
  CHECK(std::get<Pose>(*cell::get_effect(moved.effects, "laser_mount", "laser", "T_E_L")).isApprox(mount));
  pose.value[0] += 0.1;
  CHECK_THROWS_WITH(gap::with_causes(cell, {{{"laser_mount", "laser"}, 1.0, {pose}, 0.5, {}}}),
                    Contains("laser_mount.T_E_L: expected a pose"));
}

TEST_CASE("each cause is seen by leaving it out") {
  const auto [recording, found] = explained({friction(), offset()});
  const gap::DiagnosisEvidence told = gap::diagnosis_evidence(found, recording, simulator);
  REQUIRE(told.causes.size() == 2);
  REQUIRE(told.residuals.front().residuals.cols() == 4);
  CHECK(told.held_out);
  CHECK(of_column(told.causes[0], "motion.i2").without > 3.0);
  CHECK(of_column(told.causes[0], "motion.i2").with_all == Approx(1.0).margin(0.15));
  CHECK(of_column(told.causes[1], "motion.i2").without == Approx(1.0).margin(0.15));
  CHECK(of_column(told.causes[1], "poses.x").without > 3.0);
  CHECK(*told.causes[0].deviations == Approx(100.0));
  CHECK(*told.causes[1].deviations == Approx(20.0));
  const auto i2 = std::ranges::find(told.columns, "motion.i2", &gap::JudgedColumn::column);
  CHECK(i2->gap > 3.0);  // at the cell of the recording
}

TEST_CASE("a single cause is seen against the cell of the recording, and one of no catalogue not at all") {
  auto [recording, found] = explained({friction()});
  const gap::DiagnosisEvidence told = gap::diagnosis_evidence(found, recording, simulator);
  REQUIRE(told.causes.size() == 1);
  CHECK(told.residuals.front().residuals.cols() == 2);
  CHECK(told.cell_without(0) == 0);
  CHECK(of_column(told.causes[0], "motion.i2").without > 3.0);

  found.causes[0].effect = "bent_sensor";
  CHECK(gap::diagnosis_evidence(found, recording, simulator).causes.empty());
}

TEST_CASE("rivals explain part of what a cause explains, and are no causes themselves", "[not_sanitized]") {
  const auto [recording, found] = explained({friction()});
  const gap::DiagnosisEvidence told = gap::diagnosis_evidence(found, recording, simulator);
  const auto rivals = gap::rival_effects(found, told, 0, recording, simulator);
  REQUIRE(!rivals.empty());
  CHECK(rivals.size() <= 3);
  for (const gap::EffectFit& rival : rivals) {
    CHECK_FALSE(rival == found.causes[0]);
    CHECK(std::ranges::any_of(
        rival.columns, [](const gap::ColumnReduction& c) { return c.column == "motion.i2" && c.after < c.before; }));
  }
  CHECK_THROWS_WITH(gap::rival_effects(found, told, 1, recording, simulator), Contains("cause"));
}

TEST_CASE("an effect is tried in place of the cause where it does most, or as the cause that it is",
          "[not_sanitized]") {
  const auto [recording, found] = explained({friction(), offset()});
  const auto trials = gap::try_effect(found, "coulomb_friction", {"joint1", "joint2"}, recording, simulator);
  REQUIRE(trials.size() == 2);
  CHECK(trials[0].target == "joint2");
  REQUIRE(trials[0].fit);
  CHECK(trials[0].fit->explained_fraction > 0.9);
  CHECK_FALSE(trials[0].replaced);
  REQUIRE(trials[1].fit);
  CHECK(trials[1].fit->explained_fraction < 0.1);
  CHECK(trials[1].replaced);

  gap::Diagnosis bare;
  const auto alone = gap::try_effect(bare, "coulomb_friction", {"joint2"}, recording, simulator);
  REQUIRE(alone.size() == 1);
  CHECK_FALSE(alone[0].replaced);
  CHECK_THROWS_AS(gap::try_effect(bare, "coulomb_fricton", {"joint2"}, recording, simulator), InvalidArgument);
}

TEST_CASE("an effect that changes no recorded column has no fit") {
  auto [recording, found] = explained({friction()});
  recording = protocol::only(std::move(recording), cell::Kind::Motion);
  const auto trials = gap::try_effect(found, "laser_mount", {"laser"}, recording, simulator);
  REQUIRE(trials.size() == 1);
  CHECK_FALSE(trials[0].fit);
}

}  // namespace explanation_test
