// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/vision/camera_calibration_result.hpp>

#include "vision/camera_calibration/robust_adjustment.hpp"

namespace kr5::vision::detail {

/// What the views say of each other.
struct ViewTest {
  int worst = -1;           ///< The view that contradicts the others most, beyond the false-alarm rate; or -1.
  double dispersion = 1.0;  ///< Disagreement of the views over what their noise allows [-].
};
/// Fills influence and probability of the reports, and the reason of the worst one. The test is scaled by the views'
/// disagreement, at least by `correlation`, that of points which err together.
ViewTest test_views(const RobustAdjustment& fit, const std::vector<bool>& used, double false_alarm, double correlation,
                    std::vector<CameraViewReport>& reports);

}  // namespace kr5::vision::detail
