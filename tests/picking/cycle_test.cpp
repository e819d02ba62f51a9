#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/picking/cycle.hpp>

namespace cycle_test {

using namespace kr5;
using namespace kr5::picking;
using Catch::Matchers::Contains;

TEST_CASE("picking goes on from one scan while graspable cylinders are left undisturbed") {
  const CycleState state{
      .segmented = 40, .graspable = 30, .picked = 3, .failed = 2, .disturbed = 4, .failed_in_row = 1};
  const auto decision = decide_cycle(state);
  CHECK(decision.action == CycleAction::Continue);
  CHECK(decision.remaining == 21);
  CHECK(decision.picked_share == Approx(3.0 / 40));
  CHECK_THAT(decision.reason, Contains("21 graspable cylinders left undisturbed"));
}

TEST_CASE("a cycle ends with a shake when less than the threshold was picked, else with a scan") {
  CycleState state{.segmented = 100, .graspable = 60, .picked = 30, .failed = 1, .disturbed = 29};
  CHECK(decide_cycle(state).action == CycleAction::Rescan);  // 0.3 is not below 0.3
  state.picked = 29, state.disturbed = 30;
  const auto decision = decide_cycle(state);
  CHECK(decision.action == CycleAction::Shake);
  CHECK_THAT(decision.reason, Contains("29 picked, 1 failed, 30 disturbed") && Contains("only 29 % of the 100") &&
                                  Contains("less than 30 %"));
  CHECK(decide_cycle(state, {.shake_below = 0.2}).action == CycleAction::Rescan);
  CHECK(decide_cycle({.segmented = 12}).action == CycleAction::Shake);  // none graspable
  CHECK(decide_cycle({}).action == CycleAction::Shake);                 // full, but nothing certain
}

TEST_CASE("a scan is no longer believed after failures in a row") {
  CycleState state{.segmented = 10, .graspable = 10, .picked = 4, .failed = 3, .failed_in_row = 2};
  CHECK(decide_cycle(state).action == CycleAction::Continue);
  state.failed_in_row = 3;
  const auto decision = decide_cycle(state);
  CHECK(decision.action == CycleAction::Rescan);
  CHECK_THAT(decision.reason, Contains("3 attempts failed in a row"));
  CHECK(decision.remaining == 3);
}

TEST_CASE("an empty bin ends the work, and cycles without a pick call a person") {
  CHECK(decide_cycle({.empty = true}).action == CycleAction::Done);
  CHECK(decide_cycle({.idle_cycles = 5, .empty = true}).action == CycleAction::Done);
  CHECK(decide_cycle({.segmented = 5, .idle_cycles = 1}).action == CycleAction::Shake);
  const auto decision = decide_cycle({.segmented = 5, .idle_cycles = 2});
  CHECK(decision.action == CycleAction::Ask);
  CHECK_THAT(decision.reason, Contains("nothing was picked in 3 cycles in a row"));
  // A pick in this cycle ends the row.
  const CycleState late{.segmented = 9, .graspable = 1, .picked = 1, .idle_cycles = 2};
  CHECK(decide_cycle(late).action == CycleAction::Shake);
}

TEST_CASE("a scan that is not trusted is repeated, not picked from") {
  CHECK(decide_cycle({.segmented = 9, .graspable = 9, .trusted = false}).action == CycleAction::Rescan);
  CHECK(decide_cycle({.empty = true, .trusted = false}).action == CycleAction::Rescan);
  CHECK(decide_cycle({.idle_cycles = 2, .trusted = false}).action == CycleAction::Ask);
}

TEST_CASE("counts of a cycle that contradict each other are refused") {
  CHECK_THROWS_WITH(decide_cycle({.segmented = -1}), Contains("must not be negative"));
  CHECK_THROWS_WITH(decide_cycle({.segmented = 1, .graspable = 2}), Contains("graspable must not be greater"));
  CHECK_THROWS_WITH(decide_cycle({.segmented = 3, .graspable = 2, .picked = 2, .disturbed = 1}),
                    Contains("picked, failed and disturbed together"));
  CHECK_THROWS_WITH(decide_cycle({.segmented = 3, .graspable = 3, .failed_in_row = 1}), Contains("failed_in_row"));
  CHECK_THROWS_WITH(decide_cycle({.segmented = 3, .empty = true}), Contains("empty contradicts segmented"));
  CHECK_THROWS_WITH(decide_cycle({}, {.shake_below = 30}), Contains("shake_below must lie between 0 and 1"));
}

}  // namespace cycle_test
