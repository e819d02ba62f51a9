// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/geometry/view.hpp>

/// @file
/// Hand-eye from one image of a grid on two planes, whose points the robot's pose gives in the flange frame
/// (Hayat et al. 2022, section 2.2.2).

namespace kr5 {

struct SingleImageOptions {
  double sigma_pixel = 0.0;  ///< [px]
  double correlation = 1.0;  ///< [-]
  double min_depth_ratio = 0.05;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("sigma_pixel", self.sigma_pixel,
          "Standard deviation of a detected point per axis; 0: estimated from the residuals [px].");
    visit("correlation", self.correlation,
          "Ratio of the variance of correlated to that of independent point errors, as reported by the detection; it "
          "inflates the covariance, at least 1 [-].");
    visit("min_depth_ratio", self.min_depth_ratio,
          "Ratio of the least to the middle extent of the points below which they count as a plane [-].");
  }
};

struct SingleImageResult {
  Pose T_flange_camera = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< [m, rad]
  double sigma_pixel = 0.0;              ///< [px]
  double rms_px = 0.0;                   ///< [px]
  double depth_ratio = 0.0;              ///< [-]
  double error_ratio = 0.0;              ///< [-]
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("T_flange_camera", self.T_flange_camera,
          "Pose of the camera in the frame of the points, usually the flange.");
    visit("covariance", self.covariance,
          covariance_doc("T_flange_camera",
                         "Covariance of T_flange_camera from pixel noise alone, right perturbation [m, rad]."));
    visit("sigma_pixel", self.sigma_pixel, "Standard deviation of a detected point per axis, given or estimated [px].");
    visit("rms_px", self.rms_px, "RMS distance of seen and predicted points [px].");
    visit("depth_ratio", self.depth_ratio, "Ratio of the least to the middle extent of the points; 0 on a plane [-].");
    visit(
        "error_ratio", self.error_ratio,
        "RMS error of this pose over that of the pose with the plane's depth inverted; 0 for points off a plane [-].");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Pose of the camera from views whose `points` are given in the flange frame; several views must share that pose.
///
/// Errors of the robot pose that put the points into the flange frame shift the answer as a whole: the covariance does
/// not hold them. Points on one plane give FitStatus::Degenerate when two poses explain them nearly alike, and
/// otherwise a message that the turn out of the plane is weak.
/// @throws InvalidArgument for no view, fewer than six points altogether, unequal sizes, NaN, or invalid options.
SingleImageResult calibrate_single_image(std::span<const View> views, const Pinhole& camera,
                                         const SingleImageOptions& options = {});

}  // namespace kr5
