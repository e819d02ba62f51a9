// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/arm_log/compare_recordings.hpp>

namespace kr5::arm_log {

/// The causes of a difference with their values in both recordings.
/// @param reference Of the recording that the other was compared with; its causes are in the cell that was tuned to it.
/// @param own Standard deviations that the reference adds to the parameters of all causes, one after the other.
std::vector<EffectChange> changes_of(const gap::Diagnosis& difference, const gap::Diagnosis& reference,
                                     const cell::Cell& tuned, const Eigen::VectorXd& own);

/// The same change, seen from the other recording.
void reverse(std::vector<EffectChange>& changes);

}  // namespace kr5::arm_log
