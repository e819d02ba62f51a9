// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include <kr5/geometry/view.hpp>
#include <kr5/vision/camera_calibration_result.hpp>

/// @file
/// The calibration of OpenCV on the same views, to stand beside ours.

namespace kr5::vision {

/// OpenCV's calibrateCamera with the same lens model: camera, standard deviations (on the diagonal of `covariance`),
/// poses, residuals. Radial6 is not among its models.
/// @throws InvalidArgument for views that calibrate_camera refuses too, and for Radial6.
/// A failure of the peer is `FitStatus::Degenerate` with its message.
CameraCalibration calibrate_camera_opencv(std::span<const View> views, int width, int height,
                                          LensModel lens = LensModel::Brown5);

}  // namespace kr5::vision
