// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gap/planning/proposal.hpp"

namespace kr5::gap {

/// Free motions of one joint and of all: slow and fast, small and wide, from other postures, after waiting, with a
/// weight.
std::vector<Proposal> motion_proposals(const Family& family);
/// Postures to be measured from outside: spread, near, far, and of single joints.
std::vector<Proposal> pose_proposals(const Family& family);

}  // namespace kr5::gap
