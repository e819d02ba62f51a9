// SPDX-License-Identifier: BSD-3-Clause
#include "gap/stages/compare_stage.hpp"

#include "gap/recording_scope.hpp"
#include "gap/stages/stage_progress.hpp"

namespace kr5::gap {

CompareOutput compare_stage(const cell::Recording& recording, const cell::Simulator& simulator,
                            const DiagnoseOptions& options) {
  tell(options, simulating_step, 0.0);
  CompareOutput out{compare_columns(recording, simulator), {}, {}, {}};
  out.base = compare_nominal(out.data);
  out.missing_splits = missing_splits(out.data);
  out.scope = scope_limits(recording);
  return out;
}

}  // namespace kr5::gap
