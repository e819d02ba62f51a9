// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/sim/bin_rays.hpp>
#include <kr5/sim/pellet_bin.hpp>

/// @file
/// A line scanner that an arm moves across a bin of pellets. Unlike kr5/sim/line_scanner.hpp, whose rays are parallel,
/// laser and receiver stand apart: what either of them does not see has no reading.

namespace kr5::sim {

/// The scanner. Its frame: the laser in the origin, its fan in the X-Z plane about Z, away from the scanner; the
/// receiver on Y.
struct BinScannerOptions {
  int points = 640;
  double width = 0.26;          ///< [m]
  double stand_off = 0.35;      ///< [m]
  double near = 0.2;            ///< [m]
  double far = 0.45;            ///< [m]
  double baseline = 0.06;       ///< [m]
  double pitch = 0.0005;        ///< [m]
  double speed = 0.05;          ///< [m/s]
  double delay = 0.0;           ///< [s]
  double noise = 5e-5;          ///< [m]
  double grazing = 1.4;         ///< [rad]
  double specular = 0.05;       ///< [rad]
  double streaks = 0.0;         ///< [-]
  double streak_length = 0.01;  ///< [m]
  Pose T_flange_scanner = Pose(Eigen::Translation3d(0.08, 0.0, 0.06));
  int seed = 1;

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("points", self.points, "Number of points of a profile.");
    visit("width", self.width, "Width of the fan of the laser at the stand-off [m].");
    visit("stand_off", self.stand_off, "Height of the laser above the floor of the bin in a straight pass [m].");
    visit("near", self.near, "Minimum measurable z [m].");
    visit("far", self.far, "Maximum measurable z [m].");
    visit("baseline", self.baseline, "Distance of the receiver from the laser, along Y of the scanner [m].");
    visit("pitch", self.pitch, "Distance of two profiles along a straight pass [m].");
    visit("speed", self.speed, "Speed of a straight pass [m/s].");
    visit("delay", self.delay, "Time by which the time stamp of a profile is late [s].");
    visit("noise", self.noise, "Standard deviation of the range along a ray of the laser [m].");
    visit("grazing", self.grazing,
          "Angle between the normal of a surface and a ray beyond which there is no reading [rad].");
    visit("specular", self.specular,
          "Angle between the mirrored ray and the receiver below which the receiver is blinded [rad].");
    visit("streaks", self.streaks, "Share of the blinded readings that give a false range instead of none [-].");
    visit("streak_length", self.streak_length, "Maximum error of a false range, along the ray [m].");
    visit("T_flange_scanner", self.T_flange_scanner, "Scanner in the flange [m].");
    visit("seed", self.seed, "Random seed of noise and false ranges.");
  }
};

/// Poses of the flange over time.
struct ScanPath {
  Eigen::VectorXd times;            ///< [s], increasing.
  std::vector<Pose> T_base_flange;  ///< One for each time.

  static void each_field(auto& self, auto&& visit) {
    visit("times", self.times, "Times [s], increasing.");
    visit("T_base_flange", self.T_base_flange, "Flange in the base at each time [m].");
  }
};

/// Profiles with the poses of the arm at their time stamps, and what each point is of.
struct BinScan {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  using Numbers = Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Rows x, z;              ///< A row a profile, in the frame of the scanner; NaN: no reading [m].
  Numbers surface;        ///< Number of the pellet, or a BinSurface; `BinNothing` for no reading and for a false one.
  Eigen::VectorXd times;  ///< Stamps of the profiles [s].
  std::vector<Pose> T_base_flange;  ///< What the arm reports at these times.
  Pose T_flange_scanner = Pose::Identity();
  Eigen::VectorXd seen;  ///< Of each pellet: rays that laser and receiver see on it, over those they would see on it
                         ///< alone without bin and other pellets [-]; shiny spots count as seen.

  using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  /// Readings in the base, and their surfaces, profile by profile [m].
  Points cloud(std::vector<int>* surfaces = nullptr) const;
  /// Place of the laser in the base for each of these readings [m].
  Points origins() const;
};

/// A straight pass over a bin along its Y, the scanner level and looking down, its X along that of the bin.
/// @throws InvalidArgument naming the field.
ScanPath scan_path(const BinShape& bin, const BinScannerOptions& scanner = {});

/// A profile at each time of a path. A profile with a delay was taken that much earlier, at a pose that is interpolated
/// on the path; before its beginning, extrapolated.
/// @throws InvalidArgument naming the field, or for a path whose times do not increase or do not match its poses.
/// @param solids Other things that stand there.
BinScan scan_bin(const PelletScene& scene, const ScanPath& path, const BinScannerOptions& scanner = {},
                 const std::vector<SolidInBin>& solids = {});

}  // namespace kr5::sim
