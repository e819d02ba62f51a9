// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/picking/bin.hpp>
#include <kr5/picking/cloud.hpp>
#include <kr5/picking/patches.hpp>

/// @file
/// Poses of cylinders in a pile (Hayat et al. 2022, section 2.3). Each patch of surface suggests where cylinders may
/// lie; each suggestion is fitted to the points as a solid with ends and judged by the rays of the sensor: those that
/// end on it speak for it, those that pass through it against it, those that end before it hide it.

namespace kr5::picking {

struct PelletOptions {
  double radius = 0.008;
  double radius_tolerance = 0.0005;
  double min_height = 0.014;
  double max_height = 0.017;
  double noise = 0.0;
  double min_exposed = 0.2;
  double max_crossed = 0.1;
  double accepted_position_std = 0.0015;
  double accepted_axis_std = 0.06;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("radius", self.radius, "Radius of the cylinders [m].");
    visit("radius_tolerance", self.radius_tolerance, "Maximum deviation of a radius from it [m].");
    visit("min_height", self.min_height, "Minimum height of a cylinder [m].");
    visit("max_height", self.max_height, "Maximum height of a cylinder [m].");
    visit("noise", self.noise, "Standard deviation of a point; 0: from the cloud [m].");
    visit("min_exposed", self.min_exposed, "Minimum visible share of a cylinder that is listed [-].");
    visit("max_crossed", self.max_crossed,
          "Maximum share of the rays that meet a cylinder which may pass through it [-].");
    visit("accepted_position_std", self.accepted_position_std,
          "Standard deviation of the centre, in its worst direction, above which a cylinder is not listed [m].");
    visit("accepted_axis_std", self.accepted_axis_std,
          "Standard deviation of the axis, in its worst direction, above which a cylinder is not listed [rad].");
  }
};

/// A cylinder that was found.
struct Pellet {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  double radius = 0.0;
  double height = 0.0;
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();
  double exposed = 0.0;
  double crossed = 0.0;
  bool side_seen = false;
  bool face_seen = false;
  double rms = 0.0;
  int points = 0;

  static void each_field(auto& self, auto&& visit) {
    visit("centre", self.centre, "Centre of the cylinder, in the frame of the base [m].");
    visit("axis", self.axis, "Direction of the axis, of length 1, upwards.");
    visit("radius", self.radius, "Radius [m].");
    visit("height", self.height, "Height, along the axis [m].");
    visit(
        "covariance", self.covariance,
        "Covariance of the centre along the columns of `frame` [m], of the rotation about its first two [rad], of the "
        "radius and of the height [m].");
    visit("frame", self.frame, "Axes of the covariance as columns; the third is the axis.");
    visit("exposed", self.exposed, "Share of the rays towards the cylinder that end on it [-].");
    visit("crossed", self.crossed, "Share of the rays that would meet the cylinder but pass through it [-].");
    visit("side_seen", self.side_seen, "Whether points of the side were used.");
    visit("face_seen", self.face_seen, "Whether points of an end face were used.");
    visit("rms", self.rms, "RMS distance of its points to its surface [m].");
    visit("points", self.points, "Number of points on it.");
  }
};

struct PelletResult {
  std::vector<Pellet> pellets;
  CloudCheck check;
  double noise = 0.0;
  int patches = 0;
  int hypotheses = 0;
  int doubtful = 0;
  int unexplained = 0;

  static void each_field(auto& self, auto&& visit) {
    visit("pellets", self.pellets, "Cylinders found, most exposed first.");
    visit("check", self.check, "Judgement of the cloud; with anything but good no cylinder is listed.");
    visit("noise", self.noise, "Standard deviation of the points, along the normals [m].");
    visit("patches", self.patches, "Number of patches.");
    visit("hypotheses", self.hypotheses, "Number of hypotheses that were fitted.");
    visit("doubtful", self.doubtful, "Cylinders not listed, for their pose is too uncertain.");
    visit("unexplained", self.unexplained, "Points of the sample above the floor that belong to no listed cylinder.");
  }
};

/// Finds the cylinders in a bin. @throws InvalidArgument for an invalid cloud, bin or options.
PelletResult find_pellets(const Cloud& cloud, const Bin& bin, const PelletOptions& options = {});

}  // namespace kr5::picking
