// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/fit/cell_fit.hpp>

#include "fit/block.hpp"

/// @file
/// Private: a measurement of a cell fit, its residuals and their derivatives.

namespace kr5::fit {

enum class ObservationKind { Pose, Position, Distance, Plane, PlanePoints, SphereSection, Pixels };

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct Observation {
  ObservationKind kind = ObservationKind::Pose;
  PoseChain chain;
  FitPoint point, other;
  FitBlock radius, camera;
  Pose seen = Pose::Identity();
  Eigen::VectorXd whitening;                                 ///< Over sigma, by row; of pixels by point.
  Eigen::Matrix3d whitening3 = Eigen::Matrix3d::Identity();  ///< Of a position, W with W' W = C^-1.
  Matrix6 whitening6 = Matrix6::Identity();                  ///< The same of a pose.
  Eigen::MatrixXd whitening_matrix;                          ///< The same of points on a plane.
  double distance = 0.0;                                     ///< Of a sphere's section, the radius of the sphere.
  Eigen::Vector3d section = Eigen::Vector3d::Zero();         ///< x, z and radius.
  Eigen::Matrix3Xd points;
  Eigen::Matrix2Xd pixels;
  FitDeformation deformation;
  double weight = 1.0;
  int rows = 0;
  std::vector<int> blocks;  ///< Of the fit, each once.

  /// Collects `blocks`; call when all else is set.
  void finish(int row_count);
  /// Residuals over their standard deviations, times the root of `weight`, and, unless null, their derivatives by each
  /// of `blocks`, in their order: by row, as many columns as the block has stored numbers, the coordinates first and
  /// then zeros; null where not wanted. `values` likewise. False where the model does not exist, as behind a camera.
  /// `row_count` is `rows`, or condensed_rows().
  bool evaluate(const std::vector<Block>& all, const double* const* values, int row_count, double weight,
                double* residuals, double* const* jacobians) const;
  /// Rows that say as much, as few as there are: the same sum of squares, gradient and information. What a known camera
  /// sees of a known target depends on one pose alone, so that seven rows tell all of its pixels.
  int condensed_rows(const std::vector<Block>& all) const;
};

}  // namespace kr5::fit
