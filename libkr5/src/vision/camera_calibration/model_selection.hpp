// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/vision/camera_calibration.hpp>

#include "vision/camera_calibration/robust_adjustment.hpp"

namespace kr5::vision::detail {

/// Scores of all models that the options allow; the chosen one is marked. Empty with too few views.
std::vector<CameraModelScore> compare_models(const CameraProblem& problem, const RobustAdjustment& reference,
                                             const std::vector<bool>& used, const CameraOptions& options);

}  // namespace kr5::vision::detail
