// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/arm_log/log_note.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/gap/diagnose.hpp>

namespace kr5::arm_log {

/// How far the best rigid arm with friction stays off the loads of a recording, which no effect of the catalogue need
/// explain.
struct BestArmErrors {
  std::vector<gap::ColumnError> errors;                   ///< RMS in each load column, noise apart.
  std::vector<gap::ColumnCorrelation> correlations = {};  ///< Of columns whose noise is alike in neighbouring rows.
  std::vector<int> unmeasured;  ///< Joints (from 0) whose loads show nothing of what the model shows.
  double delay = 0.0;           ///< By which the loads were clearly logged late; negative: early [s].

  static void each_field(auto& self, auto&& visit) {
    visit("errors", self.errors, "RMS error in each load column, noise apart.");
    visit("correlations", self.correlations, "Correlations of columns whose noise is alike in neighbouring rows.");
    visit("unmeasured", self.unmeasured, "Joints, from 0, whose loads show nothing of what the model shows.");
    visit("delay", self.delay, "Delay by which the loads were clearly logged late; negative: early [s].");
  }
};

/// Base parameters, friction and rotors are fitted to the motions to fit on measured positions. Of a joint whose loads
/// were not measured, the error is a hundred times all of them, so that it says nothing. The delay is that of the
/// greatest likelihood, where this is far above that of none; the arm is then fitted at it, so that a clock fault does
/// not count as an error of the arm. Effects that are not in that model, such as torque ripple or backlash, are found
/// where they stand out of it. Empty unless motions are on measured positions, and the cell has drives.
/// @throws InvalidArgument as the fast simulator for a motion that it cannot predict.
BestArmErrors best_arm_errors(const cell::Recording& recording);

/// Puts the standard deviation of coloured noise in the place of that which neighbouring rows show, in the columns of
/// the loads whose noise the cell states joint by joint: where what the best arm leaves is alike in neighbouring rows
/// and is not predicted by any function of the motion. A note of what was found.
std::vector<LogNote> add_noise_colour(cell::Recording& recording);

/// What a person should know of it.
std::vector<LogNote> notes_of(const BestArmErrors& errors, const cell::Recording& recording);

/// Settings for the log of a real arm, whose description states friction of no joint, or a placeholder for each: many
/// effects at once, the best set of each size only. What differs from the defaults stays, and all of it where there are
/// no errors of the best arm.
gap::DiagnoseOptions widened_search(const gap::DiagnoseOptions& options, const BestArmErrors& errors, int joints);

}  // namespace kr5::arm_log
