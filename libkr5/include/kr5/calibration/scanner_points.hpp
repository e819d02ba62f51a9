// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/geometry/uncertain_pose.hpp>

/// @file
/// Pose of a line scanner from points that are known in its own frame and on the flange, and its pose in a camera
/// (Hayat et al. 2022, eq. 2.1-2.7 and 2.13).

namespace kr5::calibration {

struct ScannerFromPoints {
  Pose T_flange_scanner = Pose::Identity();
  double rms = 0.0;                      ///< [m]
  Matrix6 covariance = Matrix6::Zero();  ///< [m, rad]
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("T_flange_scanner", self.T_flange_scanner, "Scanner in the flange.");
    visit("rms", self.rms, "RMS distance of the points after the fit [m].");
    visit("covariance", self.covariance,
          covariance_doc(
              "T_flange_scanner",
              "Covariance of the pose, right perturbation, for noise as the residuals show it; zero of three points "
              "without noise [m, rad]."));
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Scanner in the flange from points in its profiles (x and z, 2 x n) and the same points on the flange (3 x n), by the
/// rotation nearest in the sense of least squares (Kabsch 1976): no order of the points or sign of the range is
/// assumed. Points on one line, or fewer than three, give FitStatus::Degenerate.
/// @throws InvalidArgument for numbers of points that differ, or NaN.
ScannerFromPoints scanner_from_points(const Eigen::Matrix2Xd& points_scanner, const Eigen::Matrix3Xd& points_flange);

/// The same from two points of the surface and the tip alone, without their coordinates in the profile (eq. 2.1-2.4):
/// rotation of the scanner in the flange. It is right only where x1 lies at the larger x of the scanner and, as
/// printed, x3 at a larger z than the surface; a tip nearer to the scanner than the surface, which a real one is, gives
/// an X-Z plane turned by half a turn about X, unless `tip_is_nearer`.
/// @throws InvalidArgument for points on one line.
Eigen::Matrix3d hayat2022_scanner_rotation(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2,
                                           const Eigen::Vector3d& x3, bool tip_is_nearer = false);

/// Scanner in the camera, T_flange_camera^-1 T_flange_scanner (eq. 2.13 with consistent directions), to first order.
/// `cross`: covariance of the camera's with the scanner's error, both right perturbations, where they were estimated
/// together (rows: camera).
/// @throws InvalidArgument unless the joint covariance has no negative eigenvalue.
UncertainPose camera_scanner(const UncertainPose& T_flange_camera, const UncertainPose& T_flange_scanner,
                             const Matrix6& cross = Matrix6::Zero());

}  // namespace kr5::calibration
