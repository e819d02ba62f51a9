// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/gap/diagnosis.hpp>

#include "gap/stages/judge_stage.hpp"

namespace kr5::gap {

/// Effects that come nearest to explaining what the judged model leaves, of those that were fitted beside it, with why
/// they are not blamed; smallest gap first.
std::vector<NearestEffect> nearest_effects(const ScreenOutput& screened, const JudgeOutput& judged,
                                           const DiagnoseOptions& options);

}  // namespace kr5::gap
