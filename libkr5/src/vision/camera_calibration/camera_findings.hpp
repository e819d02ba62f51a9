// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include <kr5/vision/camera_calibration_result.hpp>

#include "vision/camera_calibration/camera_stages.hpp"
#include "vision/camera_calibration/target_shape.hpp"

namespace kr5::vision::detail {

CameraCoverage coverage_of(std::span<const View> views, const std::vector<CameraViewReport>& reports, int width,
                           int height);
/// An earlier reason to refuse the result comes before a second minimum, which may follow from it.
void add_findings(const std::vector<bool>& used, const TargetPlane& plane, const std::optional<SecondCamera>& second,
                  CameraCalibration& result);

}  // namespace kr5::vision::detail
