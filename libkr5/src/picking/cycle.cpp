// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/cycle.hpp>

#include <algorithm>

#include <kr5/core/error.hpp>

#include "share_text.hpp"

namespace kr5::picking {

void CycleState::validate() const {
  require(std::min({segmented, graspable, picked, failed, disturbed, failed_in_row, idle_cycles}) >= 0,
          "the counts of a cycle must not be negative");
  require(graspable <= segmented, "graspable must not be greater than segmented");
  require(remaining() >= 0, "picked, failed and disturbed together must not be greater than graspable");
  require(failed_in_row <= failed, "failed_in_row must not be greater than failed");
  require(!empty || segmented == 0, "empty contradicts segmented: an empty bin holds no cylinder");
}

void CycleOptions::validate() const {
  require(shake_below >= 0 && shake_below <= 1, "shake_below must lie between 0 and 1 [-]");
  require(max_failed_in_row >= 1, "max_failed_in_row must be 1 or more");
  require(max_idle_cycles >= 1, "max_idle_cycles must be 1 or more");
}

namespace {

std::string count_of(int number, const char* noun) {
  return std::to_string(number) + " " + noun + (number == 1 ? "" : "s");
}

/// Why no more is picked from this scan; empty when picking may go on.
std::string end_of_cycle(const CycleState& state, const CycleOptions& options) {
  if (state.segmented == 0) return "the scan shows no cylinder whose pose is certain, but the bin is not empty";
  if (state.graspable == 0)
    return "the gripper can pick none of the " + count_of(state.segmented, "cylinder") + " that the scan shows";
  if (state.failed_in_row >= options.max_failed_in_row)
    return count_of(state.failed_in_row, "attempt") + " failed in a row, so the scan is no longer trusted";
  if (state.remaining() > 0) return {};
  return "no graspable cylinder remains (" + std::to_string(state.picked) + " picked, " + std::to_string(state.failed) +
         " failed, " + std::to_string(state.disturbed) + " disturbed)";
}

}  // namespace

CycleDecision decide_cycle(const CycleState& state, const CycleOptions& options) {
  state.validate();
  options.validate();
  CycleDecision out{.picked_share = state.picked_share(), .remaining = state.remaining()};
  const auto decide = [&](CycleAction action, const std::string& reason) {
    out.action = action;
    out.reason = reason;
    return out;
  };
  const int idle = state.idle_cycles + (state.picked == 0 ? 1 : 0);
  const bool stuck = state.picked == 0 && idle >= options.max_idle_cycles;
  const std::string often = "nothing was picked in " + count_of(idle, "cycle") + " in a row; look at the bin";
  if (!state.trusted) {
    if (stuck) return decide(CycleAction::Ask, "the scan or an image cannot be used, and " + often);
    return decide(CycleAction::Rescan, "the scan or an image since cannot be used");
  }
  if (state.empty) return decide(CycleAction::Done, "the scan shows the bin without cylinders");
  const std::string why = end_of_cycle(state, options);
  if (why.empty())
    return decide(CycleAction::Continue, count_of(out.remaining, "graspable cylinder") + " left undisturbed");
  if (stuck) return decide(CycleAction::Ask, why + "; " + often);
  if (state.picked_share() < options.shake_below)
    return decide(CycleAction::Shake, why + "; only " + share_text(out.picked_share) + " of the " +
                                          count_of(state.segmented, "cylinder") + " found was picked, less than " +
                                          share_text(options.shake_below));
  return decide(CycleAction::Rescan, why + "; " + share_text(out.picked_share) + " of the " +
                                         count_of(state.segmented, "cylinder") + " found was picked");
}

}  // namespace kr5::picking
