// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/geometry/pose.hpp>

#include "vision/camera_calibration/target_shape.hpp"

/// @file
/// Bundle adjustment of a camera, the poses of its views and the shape of the target. "Shared" parameters are those of
/// the camera (12) and of the target's shape (5).

namespace kr5::vision::detail {

struct CameraState {
  Pinhole camera;
  Shape shape = Shape::Zero();
  std::vector<Pose> poses;  ///< T_camera_target of each view.
};

/// One view, linearised: gradient and information (of half the weighted sum of squares) by its pose and by the
/// shared parameters.
struct ViewEquations {
  Matrix6 pose = Matrix6::Zero();
  Vector6 pose_gradient = Vector6::Zero();
  Eigen::MatrixXd cross;   ///< free x 6
  Eigen::MatrixXd shared;  ///< free x free
  Eigen::VectorXd shared_gradient;
  double cost = 0.0;

  /// Information on the shared parameters once the pose is unknown, and the gradient likewise.
  Eigen::MatrixXd reduced() const;
  Eigen::VectorXd reduced_gradient() const;
};

/// Weights of points [1/px^2], one vector a view; an empty or zero one leaves the view out.
using Weights = std::vector<Eigen::VectorXd>;

struct CameraProblem {
  std::span<const View> views;
  TargetPlane plane;
  int max_iterations = 60;
};

/// Seen minus predicted; empty when a point lies behind the camera or at the pole of the lens model.
Eigen::Matrix2Xd residuals(const CameraProblem& problem, const CameraState& state, std::size_t view);
/// The same as one column u1 v1 u2 v2 ... with its derivatives; false as above.
bool linearise(const CameraProblem& problem, const CameraState& state, std::size_t view, Eigen::VectorXd& r,
               Eigen::MatrixXd& by_shared, Eigen::Matrix<double, Eigen::Dynamic, 6>& by_pose);

struct Adjustment {
  CameraState state;
  std::vector<ViewEquations> blocks;  ///< At `state`.
  double cost = 0.0;
  int iterations = 0;
  bool converged = false;
};
/// Levenberg-Marquardt with fixed weights; poses are eliminated from the normal equations.
Adjustment adjust(const CameraProblem& problem, const Eigen::MatrixXd& basis, CameraState start, const Weights& weights,
                  int max_iterations);
/// Pose of one view under a known camera.
Pose fit_pose(const CameraProblem& problem, const CameraState& state, std::size_t view, const Eigen::VectorXd& weights);

}  // namespace kr5::vision::detail
