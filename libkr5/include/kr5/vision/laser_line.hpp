// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/uncertain_pose.hpp>
#include <kr5/vision/image.hpp>

/// @file
/// Points of a line scanner's profile beside the laser line that a camera sees: a check of the pose of the scanner in
/// the camera (Hayat et al. 2022, eq. 2.13) that no calibration has used.

namespace kr5::vision {

struct LaserLineOptions {
  int reach = 40;             ///< [px]
  double min_contrast = 6.0;  ///< [-]
  double min_share = 0.3;     ///< [-]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("reach", self.reach, "Distance from a projected point up to which the line is looked for, across it [px].");
    visit("min_contrast", self.min_contrast,
          "Contrast of the line, in robust standard deviations of the grey levels around it [-].");
    visit("min_share", self.min_share, "Share of the points beside which the line must be seen [-].");
  }
};

struct LaserLineComparison {
  Eigen::Matrix2Xd projected;  ///< [px]
  Eigen::Matrix2Xd seen;       ///< [px]
  Eigen::VectorXd distance;    ///< [px]
  int with_line = 0;           ///< [-]
  double rms_px = 0.0;         ///< [px]
  double mean_px = 0.0;        ///< [px]
  double expected_std = 0.0;   ///< [px]
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("projected", self.projected, "Projected points that lie in the image, 2 x n [px].");
    visit("seen", self.seen, "Middle of the line beside each, 2 x n; NaN where none is seen [px].");
    visit("distance", self.distance, "Distance of the line from each, across it; NaN where none is seen [px].");
    visit("with_line", self.with_line, "Number of points beside which the line is seen.");
    visit("rms_px", self.rms_px, "RMS of the distances [px].");
    visit("mean_px", self.mean_px, "Mean of the distances [px].");
    visit("expected_std", self.expected_std,
          "Standard deviation of a distance that the covariance of the pose gives, RMS over the points [px].");
    visit("fit", self.fit, "Report; degenerate when too little of the line is seen.");
  }
};

/// Projects the points of a profile (in the scanner, 3 x n in their order along it [m]; NaN where none was measured)
/// into an image that was taken with the flange at the same pose, and looks across the line for the bright spot nearest
/// to each. Where the profile has a step the line is broken, and is not looked for.
/// @throws InvalidArgument for an image of another size than the camera's, a covariance that is none, or an invalid
/// option.
LaserLineComparison compare_laser_line(ImageView image, const Pinhole& camera, const UncertainPose& T_camera_scanner,
                                       const Eigen::Matrix3Xd& points, const LaserLineOptions& options = {});

}  // namespace kr5::vision
