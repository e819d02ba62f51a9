// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/gap/hypotheses.hpp>

namespace kr5::gap {

/// Faults of a recording that look like effects: a group of columns that is logged late or early against the others.
std::vector<Hypothesis> recording_faults(const cell::Recording& recording);

}  // namespace kr5::gap
