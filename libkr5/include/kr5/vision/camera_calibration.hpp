// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/view.hpp>
#include <kr5/vision/camera_calibration_result.hpp>

/// @file
/// Camera calibration: focal length, principal point and lens distortion from views of targets.

namespace kr5::vision {

enum class CameraMethod { Kr5, Visp };

constexpr auto enum_names(CameraMethod) {
  return names<CameraMethod>({{CameraMethod::Kr5, "kr5"}, {CameraMethod::Visp, "visp"}});
}

struct CameraOptions {
  CameraMethod method = CameraMethod::Kr5;
  std::optional<LensModel> lens = std::nullopt;      ///< Empty: chosen by error on held-out views.
  std::optional<bool> square_pixels = std::nullopt;  ///< Empty: chosen by error on held-out views.
  std::optional<bool> bent_target = std::nullopt;    ///< Empty: chosen by error on held-out views.
  double correlation = 1.0;                          ///< [-]
  bool robust = true;
  bool reject_views = true;
  double false_alarm = 0.01;  ///< [-]
  int folds = 5;
  int max_iterations = 60;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("method", self.method,
          "Method: kr5 | visp (ViSP's vpCalibration: least squares over all views whose points are in order, lens none "
          "or k1; uncertainty and findings are computed at its camera as in kr5).");
    visit("lens", self.lens,
          "Lens model: none | k1 | k1k2 | brown4 | brown5 | radial6 | rational8; by default chosen by held-out views.");
    visit("square_pixels", self.square_pixels, "Square pixels, fx = fy; by default chosen by held-out views.");
    visit("bent_target", self.bent_target,
          "Estimation of the bending and stretching of a flat target; by default chosen by held-out views.");
    visit("correlation", self.correlation,
          "Ratio of the variance of correlated to that of independent point errors, as reported by the detection; at "
          "least 1 [-].");
    visit("robust", self.robust, "Reduced weight of points beyond 3 sigma; weight of each view by its own noise.");
    visit("reject_views", self.reject_views,
          "Exclusion of views that contradict the others (they are reported in any case).");
    visit("false_alarm", self.false_alarm,
          "Probability that any view of a sound set is reported as contradicting [-].");
    visit("folds", self.folds,
          "Number of cross-validation folds by which models are compared; 0: the given lens is fitted and nothing "
          "compared.");
    visit("max_iterations", self.max_iterations, "Maximum number of steps of each refinement.");
  }
};

/// Estimates the camera from views of one target (or of several: each view brings its own points).
///
/// 1. Start: homography or DLT of each view; the focal length is that of a logarithmic scan under which they are best
///    explained by poses (principal point in the middle, cf. Zhang 2000).
/// 2. Refinement: Levenberg-Marquardt over camera and poses, poses eliminated by Schur complement; Huber weights.
/// 3. Views that contradict the others are reported. The test compares the estimate from a view with that from all
/// other
///    views, in units of both covariances (an F statistic), once in all parameters and once in the focal length
///    alone (a zoomed or refocused lens); `false_alarm` is shared among the views and both tests.
/// 4. The model is chosen by k-fold cross-validation over views. A camera fitted to the other folds judges a held-out
///    view by leave-one-out over its points: each point is predicted from the pose fitted to the view's other points
///    (hat matrix). All models are evaluated in this way, on the same points. Brown5 with square pixels and a bent
///    target is kept unless another model does better beyond doubt (t test of the ratio of errors in each view, at 5 %
///    shared by all models): a choice by few views errs more than a few parameters do that are not needed. Otherwise
///    chosen is the model with the fewest parameters whose error exceeds the least one by no more than a standard error
///    and 1 %.
/// 5. Covariance from the information matrix, poses marginalised, noise estimated from the residuals; widened by
///    `dispersion`: the `correlation` of points that err together, or by how much views disagree more than their noise
///    allows (the lens is not quite of the model), whichever is more; the test of 3. is scaled by it too.
///
/// `CameraMethod::Visp` has the camera of ViSP's vpCalibration in place of 2. to 4.: least squares without weights,
/// over all views that 1. explains by a pose. 5. is computed there, without weights, too. Views are not left out for
/// what they say, and no second minimum is looked for. A failure of ViSP is `FitStatus::Degenerate` with its message
/// and with findings. Options that ViSP does not have are refused.
///
/// Data that cannot determine the camera give `fit.status == FitStatus::Degenerate` and the reason in `findings`: fewer
/// than three views (of flat targets; one suffices for a spatial one), all views alike or all parallel to the image.
/// @throws InvalidArgument for no view, a view with fewer than 6 points, NaN, sizes that differ, points outside the
/// image, or invalid options.
CameraCalibration calibrate_camera(std::span<const View> views, int width, int height,
                                   const CameraOptions& options = {});

}  // namespace kr5::vision
