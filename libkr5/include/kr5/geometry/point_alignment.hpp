// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>
#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// The motion between two sets of the same points.

namespace kr5 {

struct PointAlignmentOptions {
  bool scale = false;
  Eigen::VectorXd weights = {};  ///< [-]

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("scale", self.scale, "Estimation of a common scale of all distances.");
    visit("weights", self.weights, "Weight of each point, none negative; empty: all the same [-].");
  }
};

/// Where points of one frame lie in another: p_to = scale * R * p_from + t.
struct PointAlignment {
  Pose T_to_from = Pose::Identity();
  double scale = 1.0;  ///< [-]
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("T_to_from", self.T_to_from, "Pose of the frame of the first points in that of the second.");
    visit("scale", self.scale, "Distances of the second points over those of the first; 1 unless estimated [-].");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Rotation, shift and, if asked for, scale (Umeyama 1991) that carry points to others in the sense of least squares
/// (Kabsch 1976); never a mirror image. Points on one line, or all at one place, leave a turn open: the fit is
/// degenerate, and the pose one of those that explain them equally well.
/// @throws InvalidArgument for no points, sets of different sizes, NaN, or weights that do not fit.
PointAlignment align_points(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                            const PointAlignmentOptions& options = {});

}  // namespace kr5
