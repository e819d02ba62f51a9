// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/geometry/pose.hpp>
#include <kr5/vision/render.hpp>

namespace kr5::vision {

/// A flat piece of paper ruled into equal cells of one grey each, or one disc. Where sheets lie on each other, the
/// later one is seen.
struct Sheet {
  Pose T_camera_sheet = Pose::Identity();  ///< Origin at the first corner, X along the columns, Z away from the viewer.
  Eigen::Vector2d cell{1, 1};              ///< [m]
  int cols = 1, rows = 1;
  std::vector<float> grey;  ///< Row by row.
  bool disc = false;        ///< Only the circle inscribed in the single cell.
};

/// Every sheet of a placed target, lowest first.
std::vector<Sheet> sheets_of(const PlacedTarget& placed, const RenderOptions& options);

}  // namespace kr5::vision
