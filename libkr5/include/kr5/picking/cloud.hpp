// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/picking/bin.hpp>

/// @file
/// Measured points, and how profiles of a line scanner on a moving arm become points in the frame of the base (Hayat et
/// al. 2022, eq. 2.3 and section 2.3.1).

namespace kr5::picking {

/// Points in the frame of the base, with the places they were seen from, as far as those are known.
struct Cloud {
  Eigen::Matrix3Xd points;   ///< [m]; a column that is not finite is a place where nothing was measured.
  Eigen::Matrix3Xd origins;  ///< Origin of the ray of each point [m]; one column: of all rays; none: not known.

  /// @throws InvalidArgument for a number of origins that fits no point, or origins that are not finite.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("points", self.points,
          "Points, 3 x n, in the frame of the base; a column of NaN where nothing was measured [m].");
    visit("origins", self.origins,
          "Origins of the rays, 3 x n, 3 x 1 for one that all share, or empty when not known [m].");
  }
};

/// Profiles of a scanner that moves. The profile lies in the X-Z plane of the scanner.
struct ProfileScan {
  Eigen::MatrixXd x;                ///< One row a profile [m].
  Eigen::MatrixXd z;                ///< The same size; NaN where nothing was measured [m].
  Eigen::VectorXd times;            ///< Of the profiles, rising [s].
  std::vector<Pose> T_base_flange;  ///< Poses of the arm.
  Eigen::VectorXd pose_times;       ///< Of the poses, rising [s].
  Pose T_flange_scanner = Pose::Identity();
  double delay = 0.0;  ///< [s]

  /// @throws InvalidArgument naming the field and the row.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("x", self.x, "Positions along the profiles, one row a profile [m].");
    visit("z", self.z, "Distances from the scanner; NaN where nothing was measured [m].");
    visit("times", self.times, "Times of the profiles, rising [s].");
    visit("T_base_flange", self.T_base_flange, "Poses of the arm.");
    visit("pose_times", self.pose_times, "Times of the poses, rising [s].");
    visit("T_flange_scanner", self.T_flange_scanner, "Pose of the scanner on the flange.");
    visit("delay", self.delay,
          "Time by which the stamp of a profile is later than its exposure on the clock of the poses [s].");
  }
};

/// Points of a scan, each profile at the pose of the arm when it was exposed: poses are interpolated (position
/// linearly, orientation along the shortest turn) at the time of the profile less the delay. Profiles exposed before
/// the first pose or after the last are left out. Columns stand in the order of the profiles, NaN kept, so that an
/// image of the scan keeps its shape. @throws InvalidArgument for an invalid scan, or when no profile lies within the
/// times of the poses.
Cloud cloud_from_profiles(const ProfileScan& scan);

/// What a cloud is like that cannot be picked from, or Good.
enum class CloudFinding {
  Good,
  Empty,        ///< No finite point.
  WrongUnit,    ///< Divided by 1000 the points fit the bin: millimetres.
  OutsideBin,   ///< Hardly any point lies within the bin: a wrong pose of the bin, or a cloud in another frame.
  UpsideDown,   ///< The points fill the space below the floor of the bin.
  SensorBelow,  ///< The rays begin below the middle of the walls.
  NoPellets,    ///< Nothing but floor and walls.
  Sparse,       ///< Points too far apart for the radius.
};
constexpr auto enum_names(CloudFinding) {
  return names<CloudFinding>({{CloudFinding::Good, "good"},
                              {CloudFinding::Empty, "empty"},
                              {CloudFinding::WrongUnit, "wrong_unit"},
                              {CloudFinding::OutsideBin, "outside_bin"},
                              {CloudFinding::UpsideDown, "upside_down"},
                              {CloudFinding::SensorBelow, "sensor_below"},
                              {CloudFinding::NoPellets, "no_pellets"},
                              {CloudFinding::Sparse, "sparse"}});
}

/// Judgement of a cloud before anything is looked for in it.
struct CloudCheck {
  CloudFinding finding = CloudFinding::Empty;
  std::string message = "not run";  ///< In words, with the remedy.
  int finite = 0;
  int inside = 0;
  double spacing = 0.0;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("finding", self.finding, "Whether the cloud may be used, or why not.");
    visit("message", self.message, "Explanation, with the remedy.");
    visit("finite", self.finite, "Number of points that were measured.");
    visit("inside", self.inside, "Number of points within the walls, above the floor and below the rim.");
    visit("spacing", self.spacing, "Median distance of neighbouring points within the bin [m].");
  }
};

/// @param radius Of the cylinders looked for [m]. @throws InvalidArgument for an invalid cloud, bin or radius.
CloudCheck check_cloud(const Cloud& cloud, const Bin& bin, double radius);

/// The points within the walls, between the floor and the rim, and their rays. `floor_margin` and `wall_margin` keep
/// away from both [m]; what was not measured is left out.
Cloud crop(const Cloud& cloud, const Bin& bin, double floor_margin = 0.0, double wall_margin = 0.0);

}  // namespace kr5::picking
