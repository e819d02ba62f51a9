// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/fit/measurement.hpp>

/// @file
/// What a camera sees of a target.

namespace kr5::fit {

/// How a target departs from its nominal points: point k is moved by rows 3 k to 3 k + 2 of `displacements` times the
/// numbers of a block, such as bow and stretch of a board.
struct FitDeformation {
  FitBlock amounts;               ///< A vector.
  Eigen::MatrixXd displacements;  ///< 3 n x amounts [m per unit].
};

/// Pixels (2 x n) of points (3 x n) of the chain's last frame, which may deform; the chain begins in the camera.
class PixelMeasurement final : public Measurement {
 public:
  /// With a standard deviation per axis [px].
  PixelMeasurement(PoseChain T_camera_target, FitBlock camera, Eigen::Matrix3Xd points, Eigen::Matrix2Xd pixels,
                   double sigma, FitDeformation deformation = {});

  /// Gives each point its own standard deviation [px]; infinite: it has no part.
  void set_sigmas(const Eigen::VectorXd& sigmas);

  int rows() const override { return static_cast<int>(2 * points_.cols()); }
  void declare(BlockUse& use) const override;
  bool evaluate(const Evaluation& e) const override;
  /// What a known camera sees of a known target depends on one pose alone, so that seven rows tell all of its pixels.
  int condensed_rows(const std::function<bool(FitBlock)>& free) const override;

 private:
  struct Rows;
  template <class Visit>
  bool each_pixel(const Evaluation& e, const Pose& T, Visit&& visit) const;
  Eigen::Matrix3Xd deformed_points(const Evaluation& e) const;
  bool evaluate_all(const Evaluation& e, const ChainState& at) const;
  bool evaluate_condensed(const Evaluation& e, const ChainState& at) const;

  PoseChain chain_;
  FitBlock camera_;
  Eigen::Matrix3Xd points_;    ///< [m]
  Eigen::Matrix2Xd pixels_;    ///< [px]
  Eigen::VectorXd whitening_;  ///< Over sigma, by point [1/px].
  FitDeformation deformation_;
};

}  // namespace kr5::fit
