// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/gap/diagnosis.hpp>

#include "gap/stages/judge_stage.hpp"

/// @file
/// Last stage of a diagnosis: what the others found, as figures.

namespace kr5::gap {

/// All but the computing times.
Diagnosis report_stage(const CompareOutput& compared, const NoiseOutput& noise, const ScreenOutput& screened,
                       const JudgeOutput& judged, const DiagnoseOptions& options);

}  // namespace kr5::gap
