// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/force/safety_stop.hpp>
#include <kr5/identification/gravity_model.hpp>
#include <kr5/physics/motors.hpp>

/// @file
/// Passive compliance: current limits a margin above what gravity and friction take, so that an obstructed joint gives
/// way, and the contact forces at which it does (Hayat et al. 2022, section 5.2).

namespace kr5::identification {

struct PassiveLimitOptions {
  double margin = 0.1;                                 ///< [-]
  double min_limit = 0.0;                              ///< [A]
  double confidence = 0.95;                            ///< [-]
  Pose T_flange_tool = Pose::Identity();               ///< Where contact is made.
  Eigen::Matrix3Xd directions = default_directions();  ///< Unit vectors in axes of B.
  double contact_force = 0.0;                          ///< [N]

  /// @throws InvalidArgument naming the offending field.
  void validate() const;
  /// Along the axes of B, both ways.
  static Eigen::Matrix3Xd default_directions();

  static void each_field(auto& self, auto&& visit) {
    visit("margin", self.margin, "Margin above what a posture and its friction need [-].");
    visit("min_limit", self.min_limit, "Lower bound of every limit, so that a joint without load can move [A].");
    visit("confidence", self.confidence,
          "Confidence with which gravity stays within what is added for its uncertainty, per motor [-].");
    visit("T_flange_tool", self.T_flange_tool, "Point of contact: tool tip in the flange frame [m, rad].");
    visit("directions", self.directions, "Directions of the contact force, unit columns in axes of B.");
    visit("contact_force", self.contact_force,
          "Force at which a standing arm must have given way in every direction, for the largest margin; 0: none [N].");
  }
};

/// Limits of a path or region, a posture a row, a direction a column.
struct PassiveLimits {
  Eigen::VectorXd limit;        ///< [A]
  Eigen::VectorXd holding;      ///< [A]
  Eigen::VectorXd friction;     ///< [A]
  Eigen::VectorXd uncertainty;  ///< [A]
  std::vector<int> posture;
  Eigen::MatrixXd yield_force;  ///< [N]
  Eigen::MatrixXi yield_motor;
  Eigen::MatrixXd push_force;  ///< [N]
  double max_margin = 0.0;     ///< [-]
  FitReport fit;               ///< Look at fit.usable() first.

  static void each_field(auto& self, auto&& visit) {
    visit("limit", self.limit, "Current limit of each motor, for all postures [A].");
    visit("holding", self.holding, "Current that holds the posture in which the limit arises [A].");
    visit("friction", self.friction, "Current of the dry friction, beta of eq. 5.8 [A].");
    visit("uncertainty", self.uncertainty, "Part of the limit for the uncertainty of gravity [A].");
    visit("posture", self.posture, "Posture in which each limit arises, counted from 0.");
    visit("yield_force", self.yield_force,
          "Force on the tool above which a standing arm gives way, postures x directions; infinite where no joint can "
          "[N].");
    visit("yield_motor", self.yield_motor, "Motor that gives way first, counted from 0; -1: none.");
    visit("push_force", self.push_force,
          "Maximum force that a moving arm exerts on what stops its tool, postures x directions; infinite where no "
          "motor limits it [N].");
    visit("max_margin", self.max_margin,
          "Margin up to which a standing arm has given way at `contact_force`; negative: with none [-].");
    visit("fit", self.fit, "Degenerate where gravity is not determined in a posture; look at fit.usable first.");
  }
};

/// Limits that hold in all of the given postures, and what they mean for a contact at the tool, by J^T.
///
/// A motor with current i and holding current h gives way to a force F on the tool beyond h - F d = -+(limit + beta),
/// where d is the current that a unit force takes; it pushes with F up to h + F d = +-(limit - beta).
/// @param postures One a row [rad or m].
/// @param coulomb Half the width of the hysteresis of each joint [N m or N].
/// @throws InvalidArgument for sizes that differ, no posture, invalid options.
PassiveLimits passive_limits(const GravityModel& model, const Eigen::VectorXd& coulomb, const physics::Motors& motors,
                             const Eigen::Ref<const Eigen::MatrixXd>& postures,
                             const PassiveLimitOptions& options = {});

}  // namespace kr5::identification
