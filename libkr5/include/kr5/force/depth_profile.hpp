// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <kr5/force/peg_on_tube.hpp>

/// @file
/// Depth profile of a tilted peg on a tube over a turn of its tilt: its minima, and the hole. Hayat et al. 2022,
/// sections 5.5 and 5.6. Azimuths are those of the lowest point of the peg's rim, from X of T; the book's alpha, of the
/// axis of the tilt, is a quarter turn more.

namespace kr5::force {

/// A place in the turn at which the peg rests lower than beside it.
struct DepthMinimum {
  double azimuth = 0.0;  ///< [rad]
  double height = 0.0;   ///< [m]
  double bend = 0.0;     ///< [m/rad]
  bool cusp = false;
  RestContact kind = RestContact::None;

  static void each_field(auto& self, auto&& visit) {
    visit("azimuth", self.azimuth, "Azimuth of the lowest point of the rim, in [0, 2 pi) [rad].");
    visit("height", self.height, "Height of the peg's bottom centre above the top face [m].");
    visit("bend", self.bend, "Jump of the slope over the azimuth; 0 for a smooth minimum [m/rad].");
    visit("cusp", self.cusp, "True when two points of the bore's edge carry the peg: the hole lies in this direction.");
    visit("kind", self.kind, "Contact that carries the peg.");
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

}  // namespace kr5::force
