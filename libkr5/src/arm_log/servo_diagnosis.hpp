// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/gap/diagnose.hpp>

/// @file
/// Diagnosis of a motion by torque servos, whose gains the model may state in another scale.

namespace kr5::arm_log {

/// A diagnosis that may begin with servos, friction and rotors as they are fitted to the motion (servo_fit.hpp). Where
/// those leave much, the search from the model as it is comes first, and its answer holds if it has one. Where
/// it leaves something unexplained, what the best arm with such servos leaves is a known error, which no effect need
/// explain.
gap::Diagnosis diagnose_servos(const cell::Recording& recording, const cell::Simulator& simulator,
                               const gap::DiagnoseOptions& options);

}  // namespace kr5::arm_log
