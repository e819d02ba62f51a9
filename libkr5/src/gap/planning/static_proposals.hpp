// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gap/planning/proposal.hpp"

/// @file
/// Experiments about one posture: what sensors see from it, and what the path correction does there.

namespace kr5::gap {

std::vector<Proposal> view_proposals(const Family& family);
std::vector<Proposal> scan_proposals(const Family& family);
std::vector<Proposal> step_proposals(const Family& family);
std::vector<Proposal> press_proposals(const Family& family);
std::vector<Proposal> profile_proposals(const Family& family);

}  // namespace kr5::gap
