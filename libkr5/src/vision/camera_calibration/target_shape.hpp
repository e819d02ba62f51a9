// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>

#include <Eigen/Core>

#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/view.hpp>

/// @file
/// The shape of a nominally flat target: five numbers that say how it is bent and stretched.

namespace kr5::vision::detail {

constexpr int shape_count = 5;
constexpr std::array<const char*, shape_count> shape_names = {"bow_xx", "bow_xy", "bow_yy", "stretch", "shear"};
constexpr int shared_count = Pinhole::parameter_count + shape_count;
using Shape = Eigen::Matrix<double, shape_count, 1>;

/// How a cloud of points lies.
struct PointSpread {
  Eigen::Vector3d centre, sizes;  ///< RMS extent along the columns of `basis`, in descending order.
  Eigen::Matrix3d basis;
};
PointSpread spread_of(const Eigen::Matrix3Xd& points);
bool is_flat(const PointSpread& spread);

/// The plane of a flat target, in which its bow and stretch are described.
struct TargetPlane {
  bool flat = false;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d basis = Eigen::Matrix3d::Identity();  ///< Columns: two directions in the plane, normal.
  double half = 1.0;                                    ///< Half the target's size [m].
};
TargetPlane common_plane(std::span<const View> views);
/// Displacements of points of the target, three rows a point, by each number of its shape [m].
Eigen::MatrixXd displacements(const TargetPlane& plane, const Eigen::Matrix3Xd& points);
/// Points of the target as bent by `shape`.
Eigen::Matrix3Xd bent_points(const TargetPlane& plane, const Shape& shape, const Eigen::Matrix3Xd& points);

}  // namespace kr5::vision::detail
