// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>

#include <kr5/calibration/hand_eye_pairs.hpp>

/// @file
/// Private: what pairs of poses must be before anything is concluded from them.

namespace kr5::calibration {

/// Its name, or its place from 0.
std::string name_of_pair(std::span<const PosePair> pairs, std::size_t i);

/// @throws InvalidArgument for fewer than three pairs, a pair given twice, a pose that is not finite or not proper.
void check_pairs(std::span<const PosePair> pairs);

}  // namespace kr5::calibration
