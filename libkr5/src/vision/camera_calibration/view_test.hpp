// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/vision/camera_calibration_result.hpp>

#include "vision/camera_calibration/robust_adjustment.hpp"

namespace kr5::vision::detail {

/// What the views say of each other.
struct ViewTest {
  std::vector<bool> noisy;  ///< Views whose points scatter far more than those of the others.
  double dispersion = 1.0;  ///< Disagreement of the views over what their noise allows [-].
};
/// Fills influence and probability of the reports. The test is scaled by the views' disagreement, at least by
/// `correlation`, that of points which err together.
ViewTest test_views(const RobustAdjustment& fit, const std::vector<bool>& used, double correlation,
                    std::vector<CameraViewReport>& reports);

}  // namespace kr5::vision::detail
