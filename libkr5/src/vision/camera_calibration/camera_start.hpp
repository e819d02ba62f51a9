// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "vision/camera_calibration/camera_adjustment.hpp"

namespace kr5::vision::detail {

/// First guess: sound[i] is false where not even a homography explains the view.
struct CameraStart {
  CameraState state;
  std::vector<bool> sound;
};
CameraStart guess_camera(std::span<const View> views, int width, int height);

}  // namespace kr5::vision::detail
