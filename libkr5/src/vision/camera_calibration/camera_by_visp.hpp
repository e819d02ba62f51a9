// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "vision/camera_calibration/camera_adjustment.hpp"

namespace kr5::vision::detail {

struct CameraByVisp {
  CameraState state;    ///< Views that are not used keep their poses.
  std::string failure;  ///< Empty when ViSP has an answer.
};
/// ViSP's vpCalibration from a first guess on, lens models None and K1 (its k_ud).
CameraByVisp camera_by_visp(const CameraProblem& problem, const CameraState& guess, const std::vector<bool>& used,
                            LensModel lens);

}  // namespace kr5::vision::detail
