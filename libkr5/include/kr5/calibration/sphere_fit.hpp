// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/core/fit_report.hpp>

/// @file
/// Centre of a sphere of known radius from points of its surface.

namespace kr5::calibration {

struct SphereFit {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();      ///< [m]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< [m^2]
  double rms = 0.0;                                      ///< [m]
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("centre", self.centre, "Centre of the sphere, in the frame of the points [m].");
    visit("covariance", self.covariance,
          covariance_doc("centre", "Covariance of the centre, for noise as the residuals show it [m^2]."));
    visit("rms", self.rms, "RMS distance of the points from the surface [m].");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Centre of least squared distances to the surface. Points of a small cap agree with a sphere on either side of them:
/// the one on the side of `start` is found. Fewer than four points, and points that do not determine the centre (on one
/// line), give FitStatus::Degenerate.
/// @param points 3 x n [m]. @param radius [m]. @param start Where the centre is believed [m].
/// @throws InvalidArgument for a radius that is not positive, or NaN.
SphereFit fit_sphere(const Eigen::Matrix3Xd& points, double radius, const Eigen::Vector3d& start);

}  // namespace kr5::calibration
