// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>
#include <kr5/identification/joint_motion.hpp>

/// @file
/// Motions that are given by few numbers, for the excitation of an arm.

namespace kr5::identification {

enum class ExcitationKind {
  Fourier,       ///< Periodic, of harmonics of one base frequency (Swevers et al. 1997).
  PointToPoint,  ///< Straight in joint values from point to point, all joints starting and ending together.
};
constexpr auto enum_names(ExcitationKind) {
  return names<ExcitationKind>(
      {{ExcitationKind::Fourier, "fourier"}, {ExcitationKind::PointToPoint, "point_to_point"}});
}

/// How a point-to-point motion goes from one point to the next.
enum class ExcitationProfile {
  Trapezoidal,  ///< Constant acceleration for a quarter of the time, constant speed, constant deceleration.
  Quintic,      ///< Acceleration without jumps.
};
constexpr auto enum_names(ExcitationProfile) {
  return names<ExcitationProfile>(
      {{ExcitationProfile::Trapezoidal, "trapezoidal"}, {ExcitationProfile::Quintic, "quintic"}});
}

/// A motion of n joints that starts and ends at rest.
///
/// Fourier: q_j = offset_j + sum over l of sine_jl sin(l w t) + cosine_jl cos(l w t), w = 2 pi / period.
/// Point to point: rests at points[k] at times[k].
struct ExcitationMotion {
  ExcitationKind kind = ExcitationKind::Fourier;
  double period = 0.0;          ///< [s]
  Eigen::VectorXd offset = {};  ///< [rad or m]
  Eigen::MatrixXd sine = {};    ///< [rad or m]
  Eigen::MatrixXd cosine = {};  ///< [rad or m]
  ExcitationProfile profile = ExcitationProfile::Trapezoidal;
  Eigen::MatrixXd points = {};  ///< [rad or m]
  Eigen::VectorXd times = {};   ///< [s]

  int joints() const { return static_cast<int>(kind == ExcitationKind::Fourier ? offset.size() : points.cols()); }
  /// [s]
  double duration() const;
  /// States at these times, torques zero. Times before the start and behind the end are at rest there.
  /// @throws InvalidArgument when the motion is empty or its sizes differ.
  JointMotion states(const Eigen::VectorXd& times_wanted) const;
  /// The same at a constant rate from 0 to the end.
  JointMotion sampled(double interval) const;

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "Kind of the motion: fourier | point_to_point.");
    visit("period", self.period, "Base period of the harmonics [s].");
    visit("offset", self.offset, "Constant part of each joint value [rad or m].");
    visit("sine", self.sine, "Factors of the sines, joints x harmonics [rad or m].");
    visit("cosine", self.cosine, "Factors of the cosines, joints x harmonics [rad or m].");
    visit("profile", self.profile, "Profile between points: trapezoidal | quintic.");
    visit("points", self.points, "Points, a row each, the start first [rad or m].");
    visit("times", self.times, "Times at the points, 0 first [s].");
  }
};

}  // namespace kr5::identification
