// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/geometry/pinhole.hpp>

#include "vision/camera_calibration/target_shape.hpp"

namespace kr5::vision::detail {

/// A model to be fitted: which of the shared parameters are free.
struct CameraModel {
  LensModel lens = LensModel::None;
  bool square_pixels = false;
  bool bent_target = false;
  bool centred = false;  ///< Principal point held; only for the start.
  bool operator==(const CameraModel&) const = default;
};
/// Shared parameters that the model frees; fy is not listed when it follows fx.
std::vector<int> free_parameters(const CameraModel& model);
/// Columns: free parameters; shared change = basis * free change.
Eigen::MatrixXd free_basis(const CameraModel& model);
std::vector<std::string> free_names(const CameraModel& model);
/// Puts parameters that the model holds at 0 to 0, and fy to fx for square pixels.
void apply_model(const CameraModel& model, Pinhole& camera, Shape& shape);

}  // namespace kr5::vision::detail
