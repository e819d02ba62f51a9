// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/fit/problem.hpp>

#include "calibration/hand_eye/noise.hpp"

/// @file
/// Private: the refinement over pixels, behind calibrate_hand_eye (a diagnosis compares readings by the quicker fit of
/// hand_eye_diagnosis/reading_fit.hpp). A fit finds the two poses and that of the target in each view; variances
/// come from what the views say to first order.

namespace kr5::calibration::hand_eye {

/// From the reported robot pose to the one that X, Z and the pose of the target in the camera imply.
fit::PoseChain robot_error_chain(Mount mount, const Pose& T_base_flange, fit::FitBlock X, fit::FitBlock Z,
                                 fit::FitBlock seen);

class HandEyeFit {
 public:
  Variances variances;
  std::vector<double> weights;  ///< 0: the view has no part in the fit.
  Estimate estimate;            ///< At the optimum; its step is about zero.
  int iterations = 0;
  bool settled = false;

  HandEyeFit(Mount mount, const Pinhole& camera, std::vector<ObservedView> observed_views);

  Mount mount() const { return mount_; }
  const Pinhole& camera() const { return camera_; }
  const std::vector<ObservedView>& views() const { return views_; }
  Poses poses() const { return {fit_.pose(X_), fit_.pose(Z_)}; }
  /// Most probable robot pose error of view i.
  Vector6 error(std::size_t i) const;

  /// Puts the poses to these values, for the views as they choose between two poses of the target.
  void begin_at(const Poses& poses, const std::vector<ObservedView>& observed_views);
  /// Believes one of the poses in which view i may have seen the target, and begins there.
  void choose(std::size_t i, int pose);
  /// Puts the target to where the pixels of view i alone have it.
  void restart(std::size_t i);

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
  bool update_weights(bool student);
  bool move(int max_iterations);

  Mount mount_;
  Pinhole camera_;
  std::vector<ObservedView> views_;
  fit::Problem fit_;
  fit::FitBlock X_, Z_;
  std::vector<fit::FitBlock> seen_;  ///< T_camera_target by view.
  std::vector<fit::FitMeasurement> pixels_, robot_;
};

}  // namespace kr5::calibration::hand_eye
