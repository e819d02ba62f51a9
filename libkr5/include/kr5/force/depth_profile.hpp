// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fit_report.hpp>
#include <kr5/force/peg_on_tube.hpp>

/// @file
/// What a tilted peg feels on a tube when its tilt goes once round: the depth profile, where its minima are, and where
/// the hole lies. Hayat et al. 2022, sections 5.5 and 5.6. Azimuths are those of the lowest point of the peg's rim,
/// from X of T; the book's alpha, of the axis of the tilt, is a quarter turn more.

namespace kr5::force {

/// A place in the turn at which the peg rests lower than beside it.
struct DepthMinimum {
  double azimuth = 0.0;  ///< [rad]
  double height = 0.0;   ///< [m]
  double bend = 0.0;     ///< [m/rad]
  bool cusp = false;
  Rest kind = Rest::None;

  static void each_field(auto& self, auto&& visit) {
    visit("azimuth", self.azimuth, "Of the lowest point of the rim, in [0, 2 pi) [rad].");
    visit("height", self.height, "Of the peg's bottom centre above the top face [m].");
    visit("bend", self.bend, "Jump of the slope over the azimuth there; 0 where the minimum is smooth [m/rad].");
    visit("cusp", self.cusp, "Two points of the bore's edge carry the peg: the hole lies this way.");
    visit("kind", self.kind, "What carries the peg there.");
  }
};

/// The minima over a turn, the hole's first: at most two, towards the hole and away from it; none on a peg that stays
/// on the face all round, or whose centre is that of the tube. Closed form (5.35, 5.38).
/// @param tilt in (0, pi/2) [rad]; @param centre of the peg's bottom, from the centre of the tube, in T [m].
/// @throws InvalidArgument for a tilt or radii that are not valid.
std::vector<DepthMinimum> depth_minima(const PegTube& bodies, double tilt, const Eigen::Vector2d& centre);

/// Distance of the axes below which the lowest of the two minima is that of the hole (5.39); the radius of the tube
/// when it is so everywhere [m].
double critical_offset(const PegTube& bodies, double tilt);

/// By how much the azimuth of the hole is off when depth is read wrongly by `depth_error` [m]: the way to go from the
/// cusp until the peg has risen by so much [rad]; pi when it never does.
/// @throws InvalidArgument when there is no cusp.
double azimuth_error(const PegTube& bodies, double tilt, const Eigen::Vector2d& centre, double depth_error);

/// Resting heights over a grid of peg centres: row i at y[i], column j at x[j] [m]; NaN where nothing carries the peg.
Eigen::MatrixXd depth_map(const PegTube& bodies, double tilt, double azimuth, std::span<const double> x,
                          std::span<const double> y);

struct TubeFitOptions {
  double noise = 0.0;
  int max_iterations = 40;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("noise", self.noise, "Standard deviation of one height; 0: what the fit leaves [m].");
    visit("max_iterations", self.max_iterations, "Of each start.");
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
    visit("report", self.report, "How the fit ended.");
    visit("centre", self.centre, "Of the peg's bottom, from the centre of the tube, in T [m].");
    visit("face", self.face, "Height of the tube's top face in the frame of the heights [m].");
    visit("covariance", self.covariance, "Of centre x, y and face [m^2].");
    visit("azimuth", self.azimuth, "Of the hole, seen from the peg, in [0, 2 pi) [rad].");
    visit("azimuth_std", self.azimuth_std, "Its standard deviation; pi when the peg stood over the hole [rad].");
    visit("rms", self.rms, "Of what the fit leaves [m].");
  }
};

/// Least squares of heights over azimuths by the exact profile. Unlike the least height, or the sharpest minimum, it
/// uses every row, and knows the distance of the hole as well as its direction.
/// @param azimuth [rad] and @param height [m], a value a row.
/// @return Degenerate for fewer than six rows, rows that cover less than a quarter of the turn, or a profile that is
/// flat.
/// @throws InvalidArgument for unequal lengths, numbers that are not finite, a tilt or radii that are not valid.
TubeFit fit_tube(const PegTube& bodies, double tilt, std::span<const double> azimuth, std::span<const double> height,
                 const TubeFitOptions& options = {});

}  // namespace kr5::force
