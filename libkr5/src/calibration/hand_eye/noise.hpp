// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>

#include "calibration/hand_eye/model.hpp"

/// @file
/// Private: the linear mixed model behind a hand-eye fit, y_i = F_i b + e_i + n_i with three variances (robot position,
/// robot rotation, pixel), estimated by restricted maximum likelihood (REML), and what their uncertainty does to Cov b
/// (Kenward and Roger, "Small sample inference for fixed effects from REML", Biometrics 53, 1997).

namespace kr5::calibration::hand_eye {

using Vector12 = Eigen::Matrix<double, 12, 1>;
using Matrix12 = Eigen::Matrix<double, 12, 12>;

/// Variances of robot position [m^2], robot rotation [rad^2], pixel [px^2], and which of them are to be estimated.
struct Variances {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  std::array<bool, 3> free = {true, true, true};
  double lever =
      0.6;  ///< Expected ratio of robot position and rotation noise [m], held loosely (a factor e is 0.8 sd).

  Matrix6 robot() const;
  Matrix6 of(const LinearView& view) const { return robot() + value[2] * view.U; }
};

/// A view in the fit, with its weight: the covariance of y counts divided by it.
struct WeightedView {
  LinearView view;
  double weight = 1.0;
};

/// Generalised least squares at given variances.
struct Estimate {
  Vector12 b = Vector12::Zero();
  Matrix12 covariance = Matrix12::Zero();
  bool regular = false;  ///< The views determine all of b.
};
Estimate solve(std::span<const WeightedView> views, const Variances& variances);

/// Moves the free variances towards their REML values (Fisher scoring).
void estimate_variances(std::span<const WeightedView> views, Variances& variances, int max_steps);

/// Covariance of a six-vector widened so that its normal 95 % region holds the truth in 95 %, although variances were
/// estimated; `dof` belongs to the F distribution behind it.
struct WidenedCovariance {
  Matrix6 covariance;
  double dof = 0.0;
};
/// `first` is 0 for X, 6 for Z.
WidenedCovariance widened_covariance(std::span<const WeightedView> views, const Variances& variances, int first);

}  // namespace kr5::calibration::hand_eye
