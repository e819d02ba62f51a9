// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <kr5/core/fields.hpp>

/// @file
/// What to do after a pick (Hayat et al. 2022, section 2.4.3). A cycle lasts from one scan to the next.

namespace kr5::picking {

/// Counts of a cycle so far. Graspable cylinders that were neither tried nor disturbed remain.
struct CycleState {
  int segmented = 0;
  int graspable = 0;
  int picked = 0;
  int failed = 0;
  int disturbed = 0;
  int failed_in_row = 0;
  int idle_cycles = 0;
  bool empty = false;
  bool trusted = true;

  int remaining() const { return graspable - picked - failed - disturbed; }
  /// Share of the cylinders found that were picked; 0 of none.
  double picked_share() const { return segmented > 0 ? static_cast<double>(picked) / segmented : 0.0; }

  /// @throws InvalidArgument for counts that contradict each other.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("segmented", self.segmented, "Number of cylinders found in the scan.");
    visit("graspable", self.graspable, "Number of those that the gripper can pick.");
    visit("picked", self.picked, "Number of those picked since the scan.");
    visit("failed", self.failed, "Number of graspable ones that were tried and not picked.");
    visit("disturbed", self.disturbed, "Number of graspable ones, not tried, that have moved or may have moved.");
    visit("failed_in_row", self.failed_in_row, "Number of attempts that failed since the last pick.");
    visit("idle_cycles", self.idle_cycles, "Number of cycles in a row, before this one, in which nothing was picked.");
    visit("empty", self.empty, "Whether the scan shows the bin without cylinders.");
    visit("trusted", self.trusted,
          "Whether the scan and the images since may be used; not when a check of the cloud or of an image failed.");
  }
};

struct CycleOptions {
  double shake_below = 0.3;
  int max_failed_in_row = 3;
  int max_idle_cycles = 3;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("shake_below", self.shake_below,
          "Share of the cylinders found that must have been picked in a cycle; below it the bin is shaken [-].");
    visit("max_failed_in_row", self.max_failed_in_row,
          "Number of failures in a row after which the scan is no longer trusted.");
    visit("max_idle_cycles", self.max_idle_cycles,
          "Number of cycles in a row without a pick after which a person is asked.");
  }
};

enum class CycleAction {
  Continue,  ///< Pick the next one of this scan.
  Rescan,    ///< Scan again.
  Shake,     ///< Shake the bin, then scan again.
  Done,      ///< The bin is empty.
  Ask,       ///< A person is needed.
};
constexpr auto enum_names(CycleAction) {
  return names<CycleAction>({{CycleAction::Continue, "continue"},
                             {CycleAction::Rescan, "rescan"},
                             {CycleAction::Shake, "shake"},
                             {CycleAction::Done, "done"},
                             {CycleAction::Ask, "ask"}});
}

struct CycleDecision {
  CycleAction action = CycleAction::Ask;
  std::string reason = "not run";
  double picked_share = 0.0;
  int remaining = 0;

  static void each_field(auto& self, auto&& visit) {
    visit("action", self.action, "What to do next.");
    visit("reason", self.reason, "Why, in words.");
    visit("picked_share", self.picked_share, "Share of the cylinders found that were picked in this cycle [-].");
    visit("remaining", self.remaining, "Number of graspable cylinders that were neither tried nor disturbed.");
  }
};

/// Decides what to do next. While graspable cylinders remain and attempts succeed, picking goes on from the same scan.
/// A cycle ends with a scan; the bin is shaken first when too small a share of what the scan showed could be picked.
/// @throws InvalidArgument for counts that contradict each other, or invalid options.
CycleDecision decide_cycle(const CycleState& state, const CycleOptions& options = {});

}  // namespace kr5::picking
