// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Joint values that bring the flange to a pose.

namespace kr5::kinematics {

enum class InverseStatus {
  Solved,         ///< At least one posture within the limits.
  OutsideLimits,  ///< The pose is within reach, no posture within the limits.
  OutOfReach,     ///< Closed form: no posture at all, the pose is too far, too near or cannot be turned to.
  NotConverged,   ///< Iterative: no posture found; that proves nothing.
};
constexpr auto enum_names(InverseStatus) {
  using enum InverseStatus;
  return names<InverseStatus>({{Solved, "solved"},
                               {OutsideLimits, "outside_limits"},
                               {OutOfReach, "out_of_reach"},
                               {NotConverged, "not_converged"}});
}

/// Where a posture loses a degree of freedom. With the wrist centre on axis 1, or axes 4 and 6 in line, a whole line of
/// postures reaches the pose; the one given keeps the free joint (1 or 4) at its value in `InverseOptions::near`.
enum class Singularity {
  None,
  Shoulder,  ///< Wrist centre on the axis of joint 1, or where joint 1 moves it only as joints 2 and 3 can.
  Elbow,     ///< Joints 2 and 3 move the wrist centre along one line: arm stretched or folded.
  Wrist,     ///< Axes 4, 5 and 6 in one plane; in a right-angled wrist 4 and 6 in line.
  Several,
  Unnamed,  ///< Of an arm without closed form: the Jacobian has lost rank.
};
constexpr auto enum_names(Singularity) {
  using enum Singularity;
  return names<Singularity>({{None, "none"},
                             {Shoulder, "shoulder"},
                             {Elbow, "elbow"},
                             {Wrist, "wrist"},
                             {Several, "several"},
                             {Unnamed, "unnamed"}});
}

struct Posture {
  Eigen::VectorXd q;                     ///< [rad or m]
  std::vector<int> outside_limits = {};  ///< Joints, counted from 0, outside their limits even after full turns.
  Singularity singularity = Singularity::None;
  double position_error = 0.0;  ///< Of the flange, by forward kinematics [m].
  double rotation_error = 0.0;  ///< [rad]

  bool usable() const { return outside_limits.empty(); }

  static void each_field(auto& self, auto&& visit) {
    visit("q", self.q, "Joint values [rad or m].");
    visit("outside_limits", self.outside_limits, "Joints, counted from 0, outside their limits even after full turns.");
    visit("singularity", self.singularity, "Singularity of the posture.");
    visit("position_error", self.position_error, "Position error of the flange, by forward kinematics [m].");
    visit("rotation_error", self.rotation_error, "Rotation error of the flange, by forward kinematics [rad].");
  }
};

struct InverseOptions {
  Eigen::VectorXd lower = {};         ///< Least joint values; empty: no limits [rad or m].
  Eigen::VectorXd upper = {};         ///< Greatest joint values; empty: no limits [rad or m].
  Eigen::VectorXd near = {};          ///< Start, and where to stay near of several turns; empty: zeros [rad or m].
  double singular_within = 1e-6;      ///< Closed form: the relative distance at which a posture counts as singular [-].
  double position_tolerance = 1e-10;  ///< Iterative [m].
  double rotation_tolerance = 1e-10;  ///< Iterative [rad].
  int iterations = 200;               ///< Iterative: most steps from one start.
  int starts = 30;                    ///< Iterative: `near`, then random postures within the limits.
  std::uint64_t seed = 1;             ///< Of the random postures.

  /// @throws InvalidArgument naming the field.
  void validate(int joints) const;

  static void each_field(auto& self, auto&& visit) {
    visit("lower", self.lower, "Lower joint limits; empty: no limits [rad or m].");
    visit("upper", self.upper, "Upper joint limits; empty: no limits [rad or m].");
    visit("near", self.near, "Start, and preferred joint values among full turns; empty: zeros [rad or m].");
    visit("singular_within", self.singular_within, "Relative distance at which a posture counts as singular [-].");
    visit("position_tolerance", self.position_tolerance, "Position tolerance of the iterative solver [m].");
    visit("rotation_tolerance", self.rotation_tolerance, "Rotation tolerance of the iterative solver [rad].");
    visit("iterations", self.iterations, "Maximum number of iterations from one start.");
    visit("starts", self.starts, "Number of starts: `near`, then random postures within the limits.");
    visit("seed", self.seed, "Random seed of those postures.");
  }
};

struct InverseResult {
  InverseStatus status = InverseStatus::NotConverged;
  bool closed_form = false;       ///< Then `postures` are all there are, full turns apart.
  std::vector<Posture> postures;  ///< Usable ones first, then by distance from `near`.

  /// Joint values within the limits that are nearest to `near` of the options, by the norm of their difference; none
  /// where no posture is usable [rad or m].
  std::optional<Eigen::VectorXd> nearest() const;

  static void each_field(auto& self, auto&& visit) {
    visit("status", self.status, "Status: solved | outside_limits | out_of_reach | not_converged.");
    visit("closed_form", self.closed_form, "True when the postures are complete, full turns apart.");
    visit("postures", self.postures, "Postures, usable ones first, then by distance from `near`.");
  }
};

/// Six revolute joints of which the last three axes meet in one point (spherical wrist: KR5 and most industrial arms),
/// for any values of the other three, as long as these can move that point in three directions.
bool has_closed_form(const DhChain& chain);

/// In closed form where the chain has one (Pieper 1968: a quartic for joint 3), up to eight postures; otherwise one by
/// damped least squares within the limits.
/// @param T_base_flange Wanted pose of the flange.
/// @throws InvalidArgument for options of the wrong size, or a pose that is none.
InverseResult inverse_kinematics(const DhChain& chain, const Pose& T_base_flange, const InverseOptions& options = {});

}  // namespace kr5::kinematics
