// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "calibration/hand_eye/noise.hpp"

/// @file
/// Private: the refinement over pixels, behind calibrate_hand_eye (a diagnosis compares readings by the quicker fit of
/// hand_eye_diagnosis/reading_fit.hpp). The robot pose errors of the views are block-diagonal, so each is eliminated by
/// itself (its Schur complement is the marginal covariance of LinearView::y) and 12 unknowns remain.

namespace kr5::calibration::hand_eye {

struct HandEyeFit {
  Mount mount = Mount::EyeInHand;
  const Pinhole* camera = nullptr;
  std::vector<ObservedView> observed_views;
  Poses poses;
  std::vector<Vector6> errors;  ///< Most probable robot pose error of each view.
  std::vector<double> weights;  ///< 0: the view has no part in the fit.
  Variances variances;
  Estimate estimate;  ///< At the optimum; its step is about zero.
  int iterations = 0;
  bool settled = false;

  /// Linear form of view i at the present values.
  std::optional<LinearView> linear(std::size_t i) const;
  std::vector<WeightedView> active() const;

  /// Moves poses, errors and free variances to their optimum. With `student`, the views' weights become those of a
  /// Student distribution (4 degrees of freedom), which bounds what a contradicting view can do.
  void settle(int max_iterations, bool student);

  /// Squared distance of a view from what all the others say, in its own uncertainty: chi-square with 6 degrees of
  /// freedom when the variances are known.
  double deleted_distance(std::size_t i) const;

 private:
  double cost(const Poses& at, const std::vector<Vector6>& e) const;
  bool move(const std::vector<WeightedView>& views, const std::vector<std::size_t>& index);
};

}  // namespace kr5::calibration::hand_eye
