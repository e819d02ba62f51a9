// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "vision/camera_calibration/camera_adjustment.hpp"
#include "vision/camera_calibration/camera_model.hpp"

namespace kr5::vision::detail {

/// An adjustment with weights found from the residuals.
struct RobustAdjustment {
  CameraAdjustment adjustment;
  Weights weights;                 ///< Point weight / view noise^2 [1/px^2]; empty for views left out.
  std::vector<double> view_noise;  ///< [px]
  Eigen::VectorXd zoom;            ///< Direction of fx and fy alike among the free parameters.
  double sigma = 0.0;              ///< [px]
  int points = 0;
};
/// After so many rounds of weights and a fit with them; 0: the weights at the start, where it stays.
RobustAdjustment adjust_robustly(const CameraProblem& problem, const CameraModel& model, const CameraState& start,
                                 const std::vector<bool>& used, bool robust, int rounds);
/// Robust scale of a view's residuals per axis [px].
double noise_of(const Eigen::Matrix2Xd& residuals, bool robust, double lost_freedom);
/// Huber weights of the residuals of a view, threshold 3 sigma of the vector's length.
Eigen::VectorXd huber_weights(const Eigen::Matrix2Xd& residuals, double sigma);
/// Sum of the squares of a view in standard deviations, as those weights limit them.
double huber_cost(const Eigen::Matrix2Xd& residuals, double sigma);

}  // namespace kr5::vision::detail
