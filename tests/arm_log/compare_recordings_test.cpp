#include <kr5/arm_log/compare_recordings.hpp>

#include <algorithm>

#include <catch2/catch.hpp>

#include <kr5/arm_log/comparison_text.hpp>
#include <kr5/arm_log/diagnose_log.hpp>
#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "arm_log/logged_arm.hpp"
#include "gap/diagnosis_matchers.hpp"

namespace compare_recordings_test {

using namespace kr5;
using namespace kr5::test;

/// An arm that is not as its description: friction and rotors everywhere, a heavier link.
cell::Cell worn_arm() {
  cell::Cell out = moved_arm();
  for (int j = 0; j < logged_joints; ++j) {
    out.drives->friction.coulomb[j] = 3.0 - j;
    out.drives->friction.viscous[j] = 2.0 - 0.5 * j;
  }
  out.robot.links[1].mass *= 1.15;
  return out;
}

/// Other swings than those of the first log, unless the seed is its own.
cell::Recording recorded(const cell::Cell& arm, std::uint64_t seed, double slowness = 1.0) {
  LoggedMotionOptions options;
  options.seed = seed;
  options.slowness = slowness;
  return arm_log::prepare_log(logged(arm, options), described_arm()).recording;
}

arm_log::RecordingComparison compared(const cell::Cell& first, const cell::Cell& second, std::uint64_t seed = 11,
                                      double slowness = 1.15) {
  return arm_log::compare_recordings(recorded(first, seed), recorded(second, seed + 1, slowness),
                                     predict::FastSimulator());
}

void check_only(const arm_log::RecordingComparison& found, const std::string& effect, const std::string& target) {
  INFO(text(found));
  INFO(text(found.first));
  INFO(text(found.difference));
  REQUIRE(found.changes.size() == 1);
  CHECK(found.changes[0].effect == effect);
  CHECK(found.changes[0].target == target);
}

TEST_CASE("two logs of one arm differ in nothing however wrong their model is") {
  const auto found = compared(worn_arm(), worn_arm());
  CHECK(found.difference.verdict == gap::Verdict::NoGap);
  CHECK(found.changes.empty());
  CHECK(found.common.size() == found.first.causes.size());
  CHECK(!found.common.empty());
  CHECK(found.gap_with_first < 0.5 * found.gap_with_model);
}

TEST_CASE("friction that grew is the only change between two logs") {
  cell::Cell later = worn_arm();
  later.drives->friction.viscous[1] += 1.5;
  const auto found = compared(worn_arm(), later);
  check_only(found, "viscous_friction", "joint2");
  const auto& size = found.changes[0].parameters.at(0);
  const double change = size.second.at(0) - size.first.at(0);
  CHECK(std::abs(change - 1.5) < 4 * size.std.at(0));
  CHECK(size.std.at(0) < 0.3);
}

TEST_CASE("a payload is the only change between logs with and without it", "[not_sanitized]") {
  cell::Cell loaded = worn_arm();
  cell::set_effect(loaded, "payload", "tool", "mass", 1.2);
  cell::set_effect(loaded, "payload", "tool", "com", Eigen::VectorXd(Eigen::Vector3d(0.02, 0.0, 0.06)));
  const auto found = compared(worn_arm(), loaded);
  check_only(found, "payload", "tool");
  CHECK(found.changes[0].parameters.at(0).second.at(0) ==
        Approx(1.2).margin(4 * found.changes[0].parameters[0].std[0]));

  const auto taken_off = compared(loaded, worn_arm());
  INFO(text(taken_off));
  INFO(text(taken_off.first));
  INFO(text(taken_off.difference));
  check_only(taken_off, "payload", "tool");
  const auto& mass = taken_off.changes[0].parameters.at(0);
  CHECK(mass.first.at(0) == Approx(1.2).margin(4 * mass.std[0]));
  CHECK(taken_off.reversed);
  CHECK(taken_off.changes[0].parameters.at(1).second.empty());  // what is not there has no centre of mass
}

/// An arm that carries a mass [kg].
cell::Cell carrying(cell::Cell arm, double mass) {
  cell::set_effect(arm, "payload", "tool", "mass", mass);
  cell::set_effect(arm, "payload", "tool", "com", Eigen::VectorXd(Eigen::Vector3d(0.02, 0.0, 0.06)));
  return arm;
}

TEST_CASE("a heavier payload is told with its whole mass", "[not_sanitized]") {
  cell::Cell described = moved_arm();
  described.drives->friction.coulomb[1] = 2.0;
  const auto found = compared(carrying(described, 1.0), carrying(described, 1.5));
  check_only(found, "payload", "tool");
  const auto& mass = found.changes[0].parameters.at(0);
  CHECK(mass.first.at(0) == Approx(1.0).margin(0.05));
  CHECK(mass.second.at(0) - mass.first.at(0) == Approx(0.5).margin(4 * mass.std[0]));
}

TEST_CASE("a ripple of both arms is no change", "[not_sanitized]") {
  cell::Cell arm = worn_arm();
  cell::set_effect(arm, "torque_ripple", "joint2", "amplitude", 1.0);
  cell::set_effect(arm, "torque_ripple", "joint2", "cycles", 24.0);
  const auto found = compared(arm, arm);
  INFO(text(found) + text(found.first) + text(found.difference));
  CHECK(found.changes.empty());
}

TEST_CASE("a load that one log did not measure is no change") {
  const cell::Cell model = described_arm();
  arm_log::ArmLog dead = logged(worn_arm());
  dead.effort.col(2) *= 1e-3;
  const cell::Recording second = arm_log::prepare_log(dead, model, {.trust = true}).recording;
  const auto found = arm_log::compare_recordings(recorded(worn_arm(), 5, 1.1), second, predict::FastSimulator());
  INFO(text(found) + text(found.first) + text(found.difference));
  CHECK(found.changes.empty());
}

TEST_CASE("a joint that turns one way only in the first log widens what is said of it", "[not_sanitized]") {
  LoggedMotionOptions slow;
  slow.slowness = 4.0;
  arm_log::ArmLog log = logged(worn_arm(), slow);
  const double duration = log.t[log.t.size() - 1];
  log.q.col(0) = 0.2 * log.t + 0.02 * (log.t.array() * 3.0).sin().matrix();  // never turns round
  log.effort = efforts_of(worn_arm(), log.t, log.q);
  Random random(7);
  for (int j = 0; j < logged_joints; ++j) log.effort.col(j) += 0.1 * random.normal_vector(log.t.size());
  REQUIRE(duration > 10);
  const cell::Recording first = arm_log::prepare_log(log, described_arm(), {.trust = true}).recording;
  const auto found = arm_log::compare_recordings(first, recorded(worn_arm(), 8), predict::FastSimulator());
  INFO(text(found) + text(found.first) + text(found.difference));
  CHECK(std::ranges::none_of(found.changes, [](const auto& change) { return change.target == "joint2"; }));
}

TEST_CASE("recordings of different robots are not compared") {
  cell::Recording other = recorded(worn_arm(), 3);
  other.cell = arm_cell({"rrrr"});
  CHECK_THROWS_AS(arm_log::compare_recordings(recorded(worn_arm(), 3), other, predict::FastSimulator()),
                  InvalidArgument);
}

TEST_CASE("standard deviations of a change hold the uncertainty of both logs", "[statistics][not_sanitized]") {
  cell::Cell later = worn_arm();
  later.drives->friction.viscous[1] += 1.5;
  const int trials = 40;
  int inside = 0, named = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const auto found = compared(worn_arm(), later, 1000 + 2 * static_cast<std::uint64_t>(trial));
    for (const arm_log::EffectChange& change : found.changes) {
      if (change.effect != "viscous_friction" || change.target != "joint2") continue;
      const auto& size = change.parameters.at(0);
      ++named;
      inside += std::abs(size.second.at(0) - size.first.at(0) - 1.5) < 1.96 * size.std.at(0);
    }
  }
  CHECK(uncertainty::binomial_interval(named, trials).high > 0.95);
  CHECK(uncertainty::binomial_interval(inside, named, 0.99).high >= 0.95);
  CHECK(uncertainty::binomial_interval(inside, named, 0.99).low <= 0.95);
}

}  // namespace compare_recordings_test
