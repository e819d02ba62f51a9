// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

namespace kr5::picking {

/// An open box of four walls: origin at the centre of the inner floor, Z up, walls along X and Y.
struct Bin {
  Pose T_base_bin = Pose::Identity();
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  double wall_thickness = 0.003;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("T_base_bin", self.T_base_bin, "Pose of the bin: origin at the centre of the inner floor, Z up.");
    visit("size", self.size, "Inner length along X, width along Y, and height of the walls [m].");
    visit("wall_thickness", self.wall_thickness, "Thickness of the walls [m].");
  }
};

}  // namespace kr5::picking
