// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <kr5/fit/problem.hpp>
#include <kr5/geometry/pose.hpp>

#include "vision/camera_calibration/camera_model.hpp"
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

  /// Information on the shared parameters once the pose is unknown, and the gradient likewise.
  Eigen::MatrixXd reduced() const;
  Eigen::VectorXd reduced_gradient() const;
};

/// Weights of points [1/px^2], one vector a view; an empty one leaves the view out.
using Weights = std::vector<Eigen::VectorXd>;

struct CameraProblem {
  std::span<const View> views;
  TargetPlane plane;
  int max_iterations = 60;
};

/// Seen minus predicted; empty when a point lies outside the range of the lens model, as behind the camera.
Eigen::Matrix2Xd residuals(const CameraProblem& problem, const CameraState& state, std::size_t view);

/// Camera, poses of the views and shape of the target as a Problem.
class CameraAdjustment {
 public:
  CameraAdjustment(const CameraProblem& problem, const CameraModel& model, const CameraState& start);

  void set_weights(const Weights& weights);
  /// Minimises the weighted sum of squares from the present state.
  void minimise();
  /// Equations of each view at the state found; zero for one that is left out.
  std::vector<ViewEquations> equations() const;

  const CameraState& state() const { return state_; }
  double cost() const { return cost_; }  ///< Infinite where the model does not exist at the start.
  int iterations() const { return iterations_; }
  bool converged() const { return converged_; }

 private:
  fit::Problem fit_;
  fit::FitBlock camera_, shape_;
  std::vector<fit::FitBlock> poses_;
  std::vector<fit::FitMeasurement> views_;
  std::vector<bool> used_;
  CameraState state_;
  double cost_ = 0.0;
  int iterations_ = 0, max_iterations_ = 0;
  bool converged_ = false;
};

/// Pose of one view under a known camera, by weighted least squares.
struct ViewPose {
  Pose T_camera_target = Pose::Identity();
  std::optional<fit::MeasurementDerivatives> derivatives;  ///< By the pose, over the standard deviations.
};
ViewPose fit_pose(const CameraProblem& problem, const CameraState& state, std::size_t view,
                  const Eigen::VectorXd& weights);

}  // namespace kr5::vision::detail
