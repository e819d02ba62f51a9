// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/core/fit_report.hpp>
#include <kr5/force/peg_on_tube.hpp>

/// @file
/// Direction of the hole from forces and moments on a tilted peg in a turn at a constant height of the arm, beside the
/// depth profile of a turn at a constant force (Hayat et al. 2022, section 5.7).

namespace kr5::force {

/// Force and moment at one azimuth, in axes of T.
struct TurnRow {
  double azimuth = 0.0;                              ///< [rad]
  double force = 0.0;                                ///< [N]
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();  ///< [N m]

  static void each_field(auto& self, auto&& visit) {
    visit("azimuth", self.azimuth, "Azimuth of the lowest point of the peg's rim [rad].");
    visit("force", self.force, "Force on the peg along Z of T [N].");
    visit("moment", self.moment, "Moment on the peg about its bottom centre, x and y of T [N m].");
  }
};

struct TurnDirection {
  FitReport report;
  double azimuth = 0.0;      ///< [rad]
  double azimuth_std = 0.0;  ///< [rad]

  static void each_field(auto& self, auto&& visit) {
    visit("report", self.report, "Report of the estimation.");
    visit("azimuth", self.azimuth, "Azimuth of the hole, seen from the peg, in [0, 2 pi) [rad].");
    visit("azimuth_std", self.azimuth_std, "Standard deviation of the azimuth [rad].");
  }
};

/// Direction from forces: the total stiffness converts them to heights of the profile, which is fitted.
/// @param stiffness [N/m]. @return Degenerate where the profile is, see fit_tube; rows without a force are left out.
/// @throws InvalidArgument for bodies, a tilt, a stiffness or rows that are not valid.
TurnDirection locate_by_force(const PegTube& bodies, double tilt, double stiffness, const std::vector<TurnRow>& rows);

/// By moments: the point at which the force acts lies to one side of the tilt's direction before the cusp and to the
/// other behind it; the azimuth is that of the jump. Neither stiffness nor geometry is needed.
/// @return Degenerate for fewer than 12 rows under a force, or when the point nowhere jumps so.
/// @throws InvalidArgument for numbers that are not finite.
TurnDirection locate_by_moment(const std::vector<TurnRow>& rows);

}  // namespace kr5::force
