// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/core/fit_report.hpp>
#include <kr5/identification/excitation_motion.hpp>
#include <kr5/identification/keep_out.hpp>

/// @file
/// Motions that excite the dynamics of an arm so that its base parameters can be told (Hayat et al. 2022, sections 4.3
/// and 4.4.3; Swevers et al. 1997).

namespace kr5::identification {

/// What a design makes good.
enum class ExcitationCriterion {
  Condition,          ///< Condition number of the base regressor with columns of unit length.
  ConditionUnscaled,  ///< The same with columns as they are, in SI units.
  Determinant,        ///< Volume of the region of the base parameters (D-optimal).
};
constexpr auto enum_names(ExcitationCriterion) {
  return names<ExcitationCriterion>({{ExcitationCriterion::Condition, "condition"},
                                     {ExcitationCriterion::ConditionUnscaled, "condition_unscaled"},
                                     {ExcitationCriterion::Determinant, "determinant"}});
}

/// What the joints may do. Empty vectors: not limited.
struct MotionLimits {
  Eigen::VectorXd lower, upper;  ///< [rad or m]
  Eigen::VectorXd speed;         ///< [rad/s or m/s]
  Eigen::VectorXd acceleration;  ///< [rad/s^2 or m/s^2]
  Eigen::VectorXd torque;        ///< [N m or N]

  static void each_field(auto& self, auto&& visit) {
    visit("lower", self.lower, "Lower joint limits [rad or m].");
    visit("upper", self.upper, "Upper joint limits [rad or m].");
    visit("speed", self.speed, "Maximum joint speeds [rad/s or m/s].");
    visit("acceleration", self.acceleration, "Maximum joint accelerations [rad/s^2 or m/s^2].");
    visit("torque", self.torque, "Maximum torques of the drives on the joint side; empty: not limited [N m or N].");
  }
};

struct ExcitationOptions {
  ExcitationKind kind = ExcitationKind::Fourier;
  ExcitationCriterion criterion = ExcitationCriterion::Condition;
  double duration = 30.0;  ///< [s]
  int harmonics = 5;
  ExcitationProfile profile = ExcitationProfile::Trapezoidal;
  double min_override = 0.3;  ///< [-]
  double limit_share = 0.9;   ///< [-]
  double ramp_time = 0.4;     ///< [s]
  bool friction = true;
  bool rotors = true;
  Eigen::VectorXd torque_noise = {};  ///< [N m or N]
  Eigen::VectorXd start = {};         ///< [rad or m]
  double lowest = -1e3;               ///< [m]
  Eigen::Matrix3Xd points = {};       ///< [m]
  std::vector<KeepOut> keep_out = {};
  double margin = 0.05;                                            ///< [m]
  Eigen::VectorXd link_radii = Eigen::VectorXd::Constant(1, 0.1);  ///< [m]
  int starts = 20;
  int exchanges = 1500;
  std::uint64_t seed = 1;
  /// Called with the part that is done; may throw to stop.
  std::function<void(double fraction)> progress = {};

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "Kind of the motion: fourier | point_to_point.");
    visit("criterion", self.criterion, "Quantity that is optimised: condition | condition_unscaled | determinant.");
    visit("duration", self.duration, "Base period of the harmonics; greatest duration from point to point [s].");
    visit("harmonics", self.harmonics, "Number of harmonics of each joint.");
    visit("profile", self.profile, "Profile between points: trapezoidal | quintic.");
    visit("min_override", self.min_override, "Minimum speed of a point-to-point stroke, over the greatest [-].");
    visit("limit_share", self.limit_share, "Share of every limit that the motion may use [-].");
    visit("ramp_time", self.ramp_time,
          "Time in which a joint reaches its greatest speed, where no acceleration is limited [s].");
    visit("friction", self.friction, "Whether Coulomb and viscous friction are to be identified.");
    visit("rotors", self.rotors, "Whether rotor inertias are to be identified.");
    visit("torque_noise", self.torque_noise, "Noise of the torque of each joint; empty: the same for all [N m or N].");
    visit("start", self.start, "Joint values at the start and the end; empty: free [rad or m].");
    visit("lowest", self.lowest, "Minimum height of the guarded points above B [m].");
    visit("points", self.points, "Guarded points in the flange frame, beside its origin, columns [m].");
    visit("keep_out", self.keep_out, "Zones that links and tool stay clear of.");
    visit("margin", self.margin, "Minimum clearance from these zones [m].");
    visit("link_radii", self.link_radii,
          "Radius of the capsules about the DH lengths of each link, then of those from the flange to the guarded "
          "points; the last value holds for all further ones [m].");
    visit("starts", self.starts, "Number of random motions of which the best is improved.");
    visit("exchanges", self.exchanges, "Number of exchanges that are tried.");
    visit("seed", self.seed, "Random seed.");
  }
};

struct Excitation {
  ExcitationMotion motion;
  MotionLimits limits;
  int base_parameters = 0;
  double condition = 0.0;           ///< [-]
  double condition_unscaled = 0.0;  ///< [-]
  double log_determinant = 0.0;     ///< [-]
  std::vector<double> condition_after;
  Eigen::VectorXd position_use, speed_use, acceleration_use, torque_use;  ///< [-]
  Eigen::VectorXd torque_peak;                                            ///< [N m or N]
  double lowest = 0.0;                                                    ///< [m]
  double clearance = 0.0;                                                 ///< [m]
  std::string nearest;
  int slowed_strokes = 0;
  FitReport fit;  ///< Look at fit.usable() first.

  static void each_field(auto& self, auto&& visit) {
    visit("motion", self.motion, "The motion.");
    visit("limits", self.limits, "Limits that it keeps.");
    visit("base_parameters", self.base_parameters, "Number of base parameters: columns of the base regressor.");
    visit("condition", self.condition, "Condition number of the base regressor with columns of unit length [-].");
    visit("condition_unscaled", self.condition_unscaled, "The same with columns as they are, in SI units [-].");
    visit("log_determinant", self.log_determinant,
          "Logarithm of the determinant of the information of one sample, per base parameter [-].");
    visit("condition_after", self.condition_after,
          "Condition number after the starts and each improvement: the one that the criterion asks for, else that of "
          "columns of unit length [-].");
    visit("position_use", self.position_use, "Part of the range of each joint that the motion covers [-].");
    visit("speed_use", self.speed_use, "Maximum speed of each joint over its limit [-].");
    visit("acceleration_use", self.acceleration_use, "Maximum acceleration of each joint over its limit [-].");
    visit("torque_use", self.torque_use, "Maximum torque of each joint over its limit; empty without limits [-].");
    visit("torque_peak", self.torque_peak,
          "Maximum torque of each joint by the nominal dynamics; empty where the cell has no masses [N m or N].");
    visit("lowest", self.lowest, "Minimum height of the guarded points above B [m].");
    visit("clearance", self.clearance,
          "Minimum clearance from the keep-out zones, between the samples too; infinite without zones [m].");
    visit("nearest", self.nearest, "What comes nearest to which zone.");
    visit("slowed_strokes", self.slowed_strokes,
          "Number of strokes that take longer than speeds and accelerations ask for, because of torques.");
    visit("fit", self.fit, "Status of the design; look at fit.usable first.");
  }
};

/// Limits that a cell states: positions, speeds and torques; no accelerations. Infinite torques are not limited.
/// @throws InvalidArgument naming what the cell does not state.
MotionLimits motion_limits(const cell::Cell& cell);

/// Torques of the drives of a cell in a motion, on the joint side: links, tool and payload, friction, rotors; samples x
/// joints [N m or N]. @throws InvalidArgument when the cell has no masses or other joints than the motion.
Eigen::MatrixXd nominal_torques(const cell::Cell& cell, const JointMotion& states);

/// Designs a motion of the arm of a cell whose torques tell its base parameters best: of random motions the best, then
/// by exchange (Fedorov's algorithm): the harmonics of one joint, or one point, are exchanged for others as long as the
/// criterion gains. Every motion that is considered keeps positions, speeds, accelerations, the nominal torques
/// (gravity, inertia, friction and rotors), the height of the guarded points and the clearance from keep-out zones, of
/// an arm of capsules about its DH lengths; not seen is whether its links touch one another. A stroke from point to
/// point whose torques are too great is slowed. The same seed gives the same motion.
///
/// A condition number is that of the columns which links, friction and rotors add to those before them, in the order of
/// eq. 4.36: for a KR5 52 of 78.
///
/// Degenerate when no motion within the limits was found; the message says which limit stood in the way.
/// @throws InvalidArgument for limits that are missing, empty or not of the arm, a start outside of them or too near to
///         a keep-out zone, and for options that are not valid.
Excitation design_excitation(const cell::Cell& cell, const MotionLimits& limits, const ExcitationOptions& options = {});

}  // namespace kr5::identification
