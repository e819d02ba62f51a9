// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/gap/diagnose.hpp>

#include "gap/reporting/residual_analysis.hpp"
#include "gap/stages/search_stage.hpp"

/// @file
/// Fifth stage of a diagnosis: what is blamed, and whether it explains the recording.

namespace kr5::gap {

struct JudgeOutput {
  SearchOutput found;   ///< With the models that were fitted to judge.
  ComparisonData data;  ///< Spikes beside the best model are marked, too.
  int late_spikes = 0;
  Verdict verdict = Verdict::NoGap;
  std::vector<Cause> causes;  ///< Most probable first.
  std::vector<ClockFault> clock_faults;
  Model model;              ///< Causes and faults of the recording; the nominal cell, where nothing is blamed.
  std::vector<bool> above;  ///< Of the groups: above the floor at the nominal cell.
  ResidualAnalysis before;  ///< Of the nominal cell.
  ResidualAnalysis after;   ///< Of the model.
};

/// What of the best model is blamed.
enum class Blame {
  Founded,  ///< What nothing speaks against.
  All,      ///< Everything: it was chosen before.
};

JudgeOutput judge_stage(const ScreenOutput& screened, SearchOutput found, const DiagnoseOptions& options,
                        Blame blames = Blame::Founded);

}  // namespace kr5::gap
