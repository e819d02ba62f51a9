// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include <Eigen/Core>

#include <kr5/core/fit_report.hpp>
#include <kr5/force/peg_on_tube.hpp>

/// @file
/// Where a tube is, from the whole depth profile of a tilted peg.

namespace kr5::force {

struct TubeFitOptions {
  double noise = 0.0;
  int max_iterations = 40;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("noise", self.noise, "Standard deviation of one height; 0: estimated from the residuals [m].");
    visit("max_iterations", self.max_iterations, "Maximum number of iterations from each start.");
  }
};

/// Where the peg stood on the tube, from the whole profile.
struct TubeFit {
  FitReport report;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();      ///< [m]
  double face = 0.0;                                     ///< [m]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< [m^2]
  double azimuth = 0.0;                                  ///< [rad]
  double azimuth_std = 0.0;                              ///< [rad]
  double rms = 0.0;                                      ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("report", self.report, "Report of the fit.");
    visit("centre", self.centre, "Centre of the peg's bottom, from the centre of the tube, in T [m].");
    visit("face", self.face, "Height of the tube's top face in the frame of the heights [m].");
    visit("covariance", self.covariance, "Covariance of centre x, y and face [m^2].");
    visit("azimuth", self.azimuth, "Azimuth of the hole, seen from the peg, in [0, 2 pi) [rad].");
    visit("azimuth_std", self.azimuth_std,
          "Standard deviation of the azimuth; pi when the peg stood over the hole [rad].");
    visit("rms", self.rms, "RMS of the residuals [m].");
  }
};

/// Least squares of heights over azimuths by the exact profile. Unlike the least height, or the sharpest minimum, it
/// uses every row, and estimates the distance of the hole as well as its direction.
/// @param azimuth [rad] and @param height [m], a value a row.
/// @return Degenerate for fewer than six rows, rows that cover less than a quarter of the turn, or a profile that is
/// flat.
/// @throws InvalidArgument for unequal lengths, numbers that are not finite, a tilt or radii that are not valid.
TubeFit fit_tube(const PegTube& bodies, double tilt, std::span<const double> azimuth, std::span<const double> height,
                 const TubeFitOptions& options = {});

}  // namespace kr5::force
