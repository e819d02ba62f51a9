// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/geometry/view.hpp>
#include <kr5/vision/find_tags.hpp>
#include <kr5/vision/find_target.hpp>

/// @file
/// Pose of a target in the camera.

namespace kr5::vision {

struct TargetPoseOptions {
  double sigma_pixel = 0.0;      ///< [px]
  double correlation = 1.0;      ///< [-]
  double ambiguous_from = 0.05;  ///< [-]
  int max_iterations = 50;
  double huber = 3.5;  ///< [-]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("sigma_pixel", self.sigma_pixel,
          "Standard deviation of a seen point per axis; 0: estimated from the view [px].");
    visit("correlation", self.correlation,
          "Ratio of the variance of correlated to that of independent point errors, as reported by the detection; it "
          "inflates the covariance and reduces the odds of the poses, at least 1 [-].");
    visit("ambiguous_from", self.ambiguous_from,
          "Probability of the second pose above which a view counts as ambiguous [-].");
    visit("max_iterations", self.max_iterations, "Maximum number of steps of the refinement.");
    visit("huber", self.huber,
          "Huber threshold in robust standard deviations, beyond which a point counts less; 0: off [-].");
  }
};

struct TargetPose {
  Pose T_camera_target = Pose::Identity();     ///< The more probable one; z > 0, rotation proper.
  Matrix6 covariance = Matrix6::Zero();        ///< Right perturbation [m, rad].
  double covariance_dof = 0.0;                 ///< [-]
  std::optional<Pose> T_camera_target_second;  ///< The other optimum of a flat target.
  double second_probability = 0.0;             ///< [-]
  double error_ratio = 0.0;                    ///< [-]
  bool ambiguous = false;
  double rms_px = 0.0;       ///< [px]
  double sigma_pixel = 0.0;  ///< [px]
  FitReport fit;             ///< Look at `fit.usable()` first.

  static void each_field(auto& self, auto&& visit) {
    visit("T_camera_target", self.T_camera_target, "Pose of the target in the camera, the more probable one.");
    visit("covariance", self.covariance,
          covariance_doc("T_camera_target", "Covariance of T_camera_target, right perturbation [m, rad]."));
    visit("covariance_dof", self.covariance_dof,
          "Degrees of freedom behind the covariance, by which it is already inflated; a million: known noise [-].");
    visit("T_camera_target_second", self.T_camera_target_second, "Second pose that explains a flat target.");
    visit("second_probability", self.second_probability, "Probability of the second pose against the first [-].");
    visit("error_ratio", self.error_ratio,
          "RMS error of the second pose over that of the first; 0 without a second [-].");
    visit("ambiguous", self.ambiguous, "Whether the noise of the pixels does not rule out the second pose.");
    visit("rms_px", self.rms_px, "RMS distance of seen and predicted points [px].");
    visit("sigma_pixel", self.sigma_pixel, "Standard deviation of a seen point per axis, given or estimated [px].");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Pose of a target from one view. A flat target has up to two poses that are local optima of the pixel error
/// (Schweighofer and Pinz 2006); both are refined on the pixels and compared by likelihood: with errors E1 <= E2 (sums
/// of squares) and n = 2 points - 6 degrees of freedom, the odds of the second are exp((E1 - E2) / 2 sigma^2) for a
/// given sigma, and (E1 / E2)^(n/2) when sigma is estimated from the same view.
/// Fewer than four points, points on a line, and points that no pose puts in front of the camera give the status
/// Degenerate. @throws InvalidArgument for NaN, shapes that do not match, a bad camera or bad options.
TargetPose estimate_target_pose(const View& view, const Pinhole& camera, const TargetPoseOptions& options = {});

/// The same of what was found in an image, with the correlation that the detection states. Fewer than six points hardly
/// tell of themselves how far they are off: their standard deviation is that of the detection, too.
TargetPose estimate_target_pose(const Detection& detection, const Pinhole& camera);
/// The same of one marker whose side is `size` [m], in the marker's own frame.
/// @throws InvalidArgument for a size that is not positive.
TargetPose estimate_tag_pose(const TagDetection& tag, double size, const Pinhole& camera);

/// The corners of a marker whose side is `size` [m], in its own frame, with their pixels and numbers.
View tag_view(const TagDetection& tag, double size);

}  // namespace kr5::vision
