// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/gap/findings.hpp>
#include <kr5/gap/hypotheses.hpp>

namespace kr5::gap {

/// Faults of a recording that look like effects: a group of columns that is logged late or early against the others.
std::vector<Hypothesis> recording_faults(const cell::Recording& recording);

/// What such a hypothesis says of a recording, by its target: which columns are late, and by how much nothing yet.
ClockFault clock_fault(const std::string& target);

}  // namespace kr5::gap
