// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "calibration/timed_hand_eye/trajectory.hpp"

/// @file
/// Offset, hand-eye and world together, from an interpolated hand stream and the camera's poses.

namespace kr5::calibration::timed {

struct Estimate {
  Pose X = Pose::Identity();  ///< T_hand_camera
  Pose Z = Pose::Identity();  ///< T_base_world
  double offset = 0.0;        ///< [s]
};

/// Closed form at a fixed offset, and by how much the streams contradict it in the median.
struct Start {
  Estimate estimate;
  double turn = 0.0;   ///< [rad]
  double shift = 0.0;  ///< [m]
};
Start closed_form_at(const Trajectory& hand, const PoseStream& camera, double offset);

/// Refines `start` and fills every estimate of the result.
void refine(const Trajectory& hand, const PoseStream& camera, const TimedHandEyeOptions& options, const Estimate& start,
            TimedHandEyeResult& result);

}  // namespace kr5::calibration::timed
