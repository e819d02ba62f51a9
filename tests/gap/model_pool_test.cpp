#include <algorithm>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/random.hpp>
#include <kr5/gap/hypotheses.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "gap/comparison_data.hpp"
#include "gap/fitting/model_pool.hpp"
#include "gap/protocol.hpp"
#include "gap/screening/screen.hpp"

namespace model_pool_test {

/// @file
/// Sets of effects that were fitted, and those of them that were dropped.

using namespace kr5;

namespace {

/// Dry friction of each joint.
std::vector<gap::Hypothesis> dry_friction(const cell::Cell& cell) {
  std::vector<gap::Hypothesis> out = gap::hypotheses(cell, gap::TimeSpan{});
  std::erase_if(out, [](const gap::Hypothesis& h) { return h.effect != "coulomb_friction"; });
  return out;
}

}  // namespace

TEST_CASE("a dropped set of effects stays dropped until it is admitted") {
  Random random(5);
  const cell::Cell broken = protocol::carrying("coulomb_friction", "joint3", "coulomb", 9.0);
  const cell::Recording recording = protocol::only(protocol::record(broken, random), cell::Kind::Motion);
  const predict::FastSimulator simulator;
  gap::ComparisonData data = gap::compare_columns(recording, simulator);
  const Eigen::VectorXd base = gap::compare_nominal(data);
  const gap::Screen screen(data, dry_friction(recording.cell), recording.cell, base, 1, {});
  REQUIRE(screen.candidates().size() == 6);
  const gap::NuisanceModel scatter;
  const gap::FitProblem problem{data, scatter, {}, 0.0};
  const auto friction_of = [&](std::size_t joint) {
    const gap::Candidate& candidate = *screen.candidates()[joint - 1];
    return gap::Part{&candidate, gap::nearly_off(candidate.hypothesis)};
  };
  const std::vector<gap::Part> pair = {friction_of(3), friction_of(4)}, single = {friction_of(3)};

  gap::ModelPool pool(problem, base, {{gap::empty_model(problem, base)}, {}});
  pool.extend(pool.nominal(), {pair}, 1);
  const gap::Model best = pool.best();
  REQUIRE(gap::same_effects(best.parts, pair));
  pool.fit_without_each(best, 2);
  REQUIRE(pool.all().size() == 4);
  const double evidence = pool.without(best, 1).log_evidence;

  const auto has = [&](const std::vector<gap::Part>& parts) {
    return std::ranges::any_of(pool.all(), [&](const gap::Model& m) { return gap::same_effects(m.parts, parts); });
  };
  pool.drop(single);
  CHECK_FALSE(has(single));
  CHECK(pool.without(best, 1).log_evidence == evidence);
  pool.extend(pool.nominal(), {single}, 1);
  pool.fit_without_each(best, 1);
  CHECK_FALSE(has(single));
  CHECK(pool.all().size() == 3);

  pool.admit(single);
  CHECK(has(single));
  CHECK(pool.all().size() == 4);
  CHECK(std::ranges::is_sorted(
      pool.all(), [](const gap::Model& a, const gap::Model& b) { return a.log_evidence > b.log_evidence; }));
}

}  // namespace model_pool_test
