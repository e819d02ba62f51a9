// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/calibration/circle_point.hpp>

/// @file
/// Private: what the covariance of an axis is of.

namespace kr5::calibration {

/// An axis whose place and tilt in its own frame changed by d = [x, y, rx, ry] [m, rad].
kinematics::AxisLine shifted_axis(const JointAxisResult& axis, const Eigen::Vector4d& d);

/// Standard deviations of an axis: of its place at the origin of its frame [m], and of its direction [rad].
double offset_std(const JointAxisResult& axis);
double tilt_std(const JointAxisResult& axis);

}  // namespace kr5::calibration
