// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

#include <kr5/calibration/circle_point.hpp>
#include <kr5/core/fit_report.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Lengths of an arm from distances of parallel axes: joints are moved such that whatever is measured travels in
/// parallel planes, which a single camera measures best (Hayat et al. 2022, section 4.4.1, eq. 4.42).

namespace kr5::calibration {

/// Axes of a six-joint arm in one frame, with the upper arm along axis 1 and axis 6 parallel to axis 1: once with the
/// forearm across axis 1, once with the forearm, and axis 6 with it, along axis 1. Joint 2 stands the same in both.
struct ParallelPlaneAxes {
  JointAxisResult axis1;
  JointAxisResult axis2;
  JointAxisResult axis3;
  JointAxisResult axis5;
  JointAxisResult axis6;
  JointAxisResult axis6_upright;
  double wrist_distance = 0.3;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("axis1", self.axis1, "Axis of joint 1.");
    visit("axis2", self.axis2, "Axis of joint 2.");
    visit("axis3", self.axis3, "Axis of joint 3.");
    visit("axis5", self.axis5, "Axis of joint 5.");
    visit("axis6", self.axis6, "Axis of joint 6, with the forearm across axis 1.");
    visit("axis6_upright", self.axis6_upright, "Axis of joint 6, with the forearm along axis 1.");
    visit("wrist_distance", self.wrist_distance,
          "Maximum distance along axis 6 of what was measured from the wrist centre, over which a tilt of axis 6 "
          "against axis 1 shifts it [m].");
  }
};

/// Distances of parallel axes.
struct ParallelPlaneDistances {
  double c_23 = 0.0;          ///< [m]
  double c_35 = 0.0;          ///< [m]
  double c_16 = 0.0;          ///< [m]
  double c_16_upright = 0.0;  ///< [m]
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  std::string objection;

  static void each_field(auto& self, auto&& visit) {
    visit("c_23", self.c_23, "Distance of the axes 2 and 3 [m].");
    visit("c_35", self.c_35, "Distance of the axes 3 and 5 [m].");
    visit(
        "c_16", self.c_16,
        "Distance of the axes 1 and 6 with the forearm across axis 1, less what a lean of the upper arm adds; negative "
        "when the forearm points away from axis 2 [m].");
    visit("c_16_upright", self.c_16_upright, "The same with the forearm along axis 1; negative beyond axis 1 [m].");
    visit("covariance", self.covariance,
          "Covariance of the four, in this order, with what axes that are not quite parallel add [m^2].");
    visit("objection", self.objection, "Reason why the distances determine no lengths; empty when there is none.");
  }
};

struct ParallelPlaneOptions {
  std::optional<double> a1 = std::nullopt;
  double min_separation = 3.0;  ///< [-]

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("a1", self.a1,
          "Approximate length a1, which selects one of two solutions [m]; by default the solution whose forearm is "
          "longer than the offset of the elbow.");
    visit("min_separation", self.min_separation,
          "Minimum distance of the two solutions, in standard deviations of a1, at which they are distinguished [-].");
  }
};

/// Lengths that follow from the distances.
struct ParallelPlaneLengths {
  double a1 = 0.0;  ///< [m]
  double a2 = 0.0;  ///< [m]
  double a3 = 0.0;  ///< [m]
  double b4 = 0.0;  ///< [m]
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  double a1_other = 0.0;    ///< [m]
  double separation = 0.0;  ///< [-]
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("a1", self.a1, "Length from axis 1 to axis 2 [m].");
    visit("a2", self.a2, "Length of the upper arm [m].");
    visit("a3", self.a3,
          "Offset of the elbow; positive when it brings the upright forearm nearer to axis 1 than axis 2 is [m].");
    visit("b4", self.b4, "Length of the forearm [m].");
    visit("covariance", self.covariance, covariance_doc("a1 a2 a3 b4", "Covariance of a1, a2, a3 and b4 [m^2]."));
    visit("a1_other", self.a1_other,
          "Length a1 of the solution that was not taken; a3 and b4 change places in it [m].");
    visit("separation", self.separation, "Distance of the two solutions, in standard deviations of a1 [-].");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Distances of the axes, across their common direction, with the uncertainty that those of the axes cause. Axes that
/// are farther from parallel than 2 degrees and three standard deviations are named in `objection`.
/// @throws InvalidArgument for an axis that was not identified.
ParallelPlaneDistances parallel_plane_distances(const ParallelPlaneAxes& axes);

/// Solves c_23 = a2, c_35^2 = a3^2 + b4^2, c_16 = a1 + b4 and c_16_upright = a1 - a3 (eq. 4.42). Of the two solutions
/// the right one is told as the options say; distances that no arm has, and solutions too close to tell apart, give
/// FitStatus::Degenerate with the reason.
/// @throws InvalidArgument for distances that are not finite, c_23 or c_35 not positive, or invalid options.
ParallelPlaneLengths lengths_from_parallel_planes(const ParallelPlaneDistances& distances,
                                                  const ParallelPlaneOptions& options = {});

/// Why the distances of parallel axes do not tell the lengths of this arm: it needs six revolute joints, axes 2 and 3
/// parallel, neighbours otherwise at right angles, a wrist whose axes meet in one point and no lateral offset of the
/// forearm. Empty when they do.
/// @param tolerance Offset [m] and, times one radian a metre, angle [rad] that still count as none.
std::string parallel_plane_objection(const kinematics::DhChain& arm, double tolerance = 0.01);

}  // namespace kr5::calibration
