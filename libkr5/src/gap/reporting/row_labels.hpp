// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/recording.hpp>

/// @file
/// What the arm was doing in each row of a recording, in words.

namespace kr5::gap {

/// RowLabels of each experiment, one a row; none where the experiment does not tell.
using RowLabels = std::vector<std::vector<std::string>>;

/// Near or far, low or high: where the flange was, halved at the medians of the recording. No words at all when it
/// hardly moved.
RowLabels pose_regions(const cell::Recording& recording);

/// At rest, slow or fast: of motions by the fastest joint, halved at the median of the rows that move.
RowLabels speeds(const cell::Recording& recording);

}  // namespace kr5::gap
