// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>

/// @file
/// First values of torque servos and of what they move, whatever a model states of them.

namespace kr5::arm_log {

/// The part of a recording, so long at most, in which all joints together go farthest, as its only experiment.
/// @throws InvalidArgument without a motion to fit.
cell::Recording moving_part(const cell::Recording& recording, double duration);

/// The cell of a recording of one motion with stiffness and damping of its servos, delay, dry friction and rotors as
/// the motion suggests. Values are tried for all joints at once, each joint takes those with which its own position
/// fits best: gains as the droop and the lag that they would mean. What the cell states is kept where nothing fits
/// better.
/// @param tell Called with the part of the work that is done.
cell::Cell guess_servos(const cell::Recording& motion, const cell::Simulator& simulator, int threads,
                        const std::function<void(double)>& tell);

}  // namespace kr5::arm_log
