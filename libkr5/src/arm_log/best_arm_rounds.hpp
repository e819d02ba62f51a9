// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/arm_log/best_arm.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>

/// @file
/// The error of the best arm beside causes that it cannot have: a tilted base, a ripple, a cable.

namespace kr5::arm_log {

/// The recording less what the causes in `tuned` add to its loads, by the simulator. Experiments that it cannot
/// simulate stay as they are.
cell::Recording without_causes(const cell::Recording& recording, const cell::Simulator& simulator,
                               const cell::Cell& tuned);

/// Whether an error of the best arm is clearly smaller than before, in some column by a third.
bool lessens(const BestArmErrors& before, const BestArmErrors& after);

}  // namespace kr5::arm_log
