// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "vision/camera_calibration/camera_adjustment.hpp"

namespace kr5::vision::detail {

/// First guesses, by falling agreement: where the views are best explained along a scan of the focal length, and where
/// else nearly as well. sound[i] is false where not even a homography explains the view.
struct CameraStart {
  std::vector<CameraState> states;
  std::vector<bool> sound;
};
CameraStart guess_camera(std::span<const View> views, int width, int height);

}  // namespace kr5::vision::detail
