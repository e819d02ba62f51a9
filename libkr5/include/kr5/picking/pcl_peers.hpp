// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/picking/bin.hpp>
#include <kr5/picking/cloud.hpp>

/// @file
/// PCL's own cylinder fit, and its tutorial on cylinders repeated over a pile, to stand beside ours.

namespace kr5::picking {

struct PclCylinderOptions {
  double min_radius = 0.006;
  double max_radius = 0.010;
  double threshold = 0.001;
  double normal_weight = 0.002;
  int iterations = 10000;
  int neighbours = 30;
  double voxel = 0.0015;
  int min_points = 25;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("min_radius", self.min_radius, "Minimum radius [m].");
    visit("max_radius", self.max_radius, "Maximum radius [m].");
    visit("threshold", self.threshold,
          "Maximum sum of the distance [m] and the angle of the normal [rad], weighted, of an inlier.");
    visit("normal_weight", self.normal_weight, "Weight of the angle in that sum; the distance has the rest of 1 [-].");
    visit("iterations", self.iterations, "Maximum number of draws for a cylinder.");
    visit("neighbours", self.neighbours, "Number of neighbours from which a normal is estimated.");
    visit("voxel", self.voxel, "Side of the cubes whose points are replaced by their mean, in a pile [m].");
    visit("min_points", self.min_points, "Minimum number of points of a cylinder, in a pile.");
  }
};

/// A cylinder as PCL finds it; without covariance.
struct PclCylinder {
  bool found = false;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  double radius = 0.0;
  double height = 0.0;
  int points = 0;

  static void each_field(auto& self, auto&& visit) {
    visit("found", self.found, "Whether there is a cylinder.");
    visit("point", self.point, "Point of the axis in the middle between the outermost points along it [m].");
    visit("axis", self.axis, "Direction of the axis, of length 1; its sign means nothing.");
    visit("radius", self.radius, "Radius [m].");
    visit("height", self.height, "Length along the axis that the points cover [m].");
    visit("points", self.points, "Number of points on it.");
  }
};

/// PCL's SACSegmentationFromNormals with refinement (`setOptimizeCoefficients`) on points, 3 x n [m].
/// @throws InvalidArgument for invalid options, or points that are not finite.
PclCylinder pcl_cylinder(const Eigen::Matrix3Xd& points, const PclCylinderOptions& options = {});

/// PCL's tutorial on cylinders, repeated over the points of a bin: crop, voxel grid, normals, RANSAC of a cylinder,
/// its points taken out, until one has too few. Beyond the tutorial, only the greatest cluster of the inliers counts,
/// as a cylinder of the tutorial has no ends.
/// @throws InvalidArgument for an invalid cloud, bin or options.
std::vector<PclCylinder> pcl_find_cylinders(const Cloud& cloud, const Bin& bin, const PclCylinderOptions& options = {});

}  // namespace kr5::picking
