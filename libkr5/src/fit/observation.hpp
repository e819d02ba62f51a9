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
  double weight = 1.0;
  int rows = 0;
  std::vector<int> blocks;  ///< Of the fit, each once.

  /// Collects `blocks`; call when all else is set.
  void finish(int row_count);
  /// Residuals over their standard deviations, times the root of `weight`, and, unless null, their derivatives: rows x
  /// coordinates for each of `blocks`, in their order; empty for one without a free coordinate. `values` likewise.
  /// False where the model does not exist, as behind a camera.
  bool evaluate(const std::vector<Block>& all, const std::vector<const double*>& values, double weight,
                double* residuals, std::vector<RowMatrix>* jacobians) const;

  /// The same with as few rows as say as much: the same sum of squares, gradient and information. What a known camera
  /// sees hangs on one pose alone, so that seven rows tell all of its pixels.
  int few_rows(const std::vector<Block>& all) const;
  bool evaluate_few(const std::vector<Block>& all, const std::vector<const double*>& values, double weight,
                    double* residuals, std::vector<RowMatrix>* jacobians) const;

 private:
  bool evaluate_rows(int row_count, const std::vector<Block>& all, const std::vector<const double*>& values,
                     double weight, double* residuals, std::vector<RowMatrix>* jacobians) const;
};

}  // namespace kr5::fit
