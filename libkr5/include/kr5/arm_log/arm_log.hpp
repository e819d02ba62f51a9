// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/core/fields.hpp>

namespace kr5::arm_log {

/// What the controller of an arm logged of a motion: a row an instant, a column a joint, in SI, the joints in the order
/// of the model. Needed are positions or commands, and efforts or currents; of an arm with torque servos commands and
/// positions suffice. What was not logged is empty.
struct ArmLog {
  Eigen::VectorXd t;        ///< In ascending order, from any instant [s].
  Eigen::MatrixXd q;        ///< Measured [rad or m].
  Eigen::MatrixXd command;  ///< Setpoints of the joints [rad or m].
  Eigen::MatrixXd effort;   ///< Of the drives, on the joint side [N m or N].
  Eigen::MatrixXd current;  ///< Of the motors [A].
  /// Stiffness of the torque servos over that of the model [-]; 0: the motors are off. Of an arm with torque servos.
  Eigen::VectorXd servo_gain;

  /// @throws InvalidArgument naming field, row and joint: sizes that do not fit each other or the model, numbers that
  ///         are not finite, times that do not rise, nothing that moves or nothing to compare.
  void validate(int joints) const;

  static void each_field(auto& self, auto&& visit) {
    visit("t", self.t, "Times, in ascending order, from any instant [s].");
    visit("q", self.q, "Measured joint values, rows x joints; empty: not logged [rad or m].");
    visit("command", self.command, "Setpoints of the joints, rows x joints; empty: not logged [rad or m].");
    visit("effort", self.effort,
          "Torques of the drives on the joint side, rows x joints; empty: not logged [N m or N].");
    visit("current", self.current, "Currents of the motors, rows x joints; empty: not logged [A].");
    visit("servo_gain", self.servo_gain,
          "Stiffness of the torque servos over that of the model, 0 while the motors are off; empty: 1 [-].");
  }
};

}  // namespace kr5::arm_log
