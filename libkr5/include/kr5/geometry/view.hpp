// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace kr5 {

/// What one image shows of a target: points whose place on the target is known, and where they were seen.
/// Detectors produce it, calibrations consume it; neither needs the other.
struct View {
  std::string name;         ///< File or number of the image, for reports.
  Eigen::Matrix3Xd points;  ///< In the target frame, one column a point [m].
  Eigen::Matrix2Xd pixels;  ///< Where each point was seen [px].
  std::vector<int> ids;     ///< Id of each point on the target.

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "File or number of the image.");
    visit("points", self.points, "Points in the target frame, 3 x n [m].");
    visit("pixels", self.pixels, "Pixels of the points, 2 x n [px].");
    visit("ids", self.ids, "Id of each point on the target.");
  }
};

}  // namespace kr5
