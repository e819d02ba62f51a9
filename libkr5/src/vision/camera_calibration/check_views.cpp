// SPDX-License-Identifier: BSD-3-Clause
#include "vision/camera_calibration/check_views.hpp"

#include <string>

#include <kr5/core/error.hpp>

namespace kr5::vision::detail {

void check_views(std::span<const View> views, int width, int height) {
  require(!views.empty(), "camera calibration: there is no view");
  require(width > 0 && height > 0, "camera calibration: width and height must be positive [px]");
  for (std::size_t i = 0; i < views.size(); ++i) {
    const View& v = views[i];
    const std::string where = "view " + std::to_string(i) + " (" + v.name + "): ";
    require(v.points.cols() == v.pixels.cols(),
            where + std::to_string(v.points.cols()) + " points but " + std::to_string(v.pixels.cols()) + " pixels");
    require(v.points.cols() >= 6, where + "has " + std::to_string(v.points.cols()) + " points, 6 are needed");
    require(v.points.allFinite() && v.pixels.allFinite(), where + "points and pixels must be finite");
    const Eigen::Vector2d low = v.pixels.rowwise().minCoeff(), high = v.pixels.rowwise().maxCoeff();
    require(low.x() > -1 && low.y() > -1 && high.x() < width && high.y() < height,
            where + "a pixel lies outside the image of " + std::to_string(width) + " x " + std::to_string(height));
  }
}

}  // namespace kr5::vision::detail
