// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/kinematics/newton_euler.hpp>

#include <kr5/predict/given.hpp>
#include <kr5/predict/postures.hpp>

namespace kr5::predict {

/// What gives way between the motor and the link of a joint: a spring with free play.
struct SoftJoint {
  int joint = 0;
  double stiffness = 0.0;  ///< [N m/rad or N/m]
  double gap = 0.0;        ///< Whole width of the free play [rad or m].
  double damping = 0.0;    ///< Ratio zeta: damper = 2 zeta sqrt(stiffness M_jj), also within the play.
  bool sags = true;        ///< At rest; the gear behind a play is too stiff for that.
};

/// The arm as it really is: the believed one with the effects it carries.
class RealArm {
 public:
  explicit RealArm(const cell::Cell& cell);

  int joints() const { return cell_.robot.joints(); }
  /// Chain in the base of the believed robot, at time t [s] of the session.
  kinematics::DhChain chain(double t) const;
  /// Equations of motion of arm, tool and payload.
  kinematics::Dynamics dynamics(double t) const;
  /// What hangs below the force sensor. Needs a tool.
  kinematics::Cut below_sensor() const;

  /// Whether the gear of a joint turns unevenly.
  bool is_bent(int joint) const { return cell_.effects.joint(joint).transmission_amplitude != 0.0; }
  /// Where a link would be if its joint were rigid, for a motor that reads q, and the derivatives of that by q.
  double angle(int joint, double q) const;
  double angle_slope(int joint, double q) const;
  double angle_bend(int joint, double q) const;

  /// What the dress pack asks of a joint whose link is at q [N m].
  double cable(int joint, double q) const;

  const std::vector<SoftJoint>& soft() const { return soft_; }
  /// Deflection at rest of a soft joint that carries `torque` [N m].
  static double sag(const SoftJoint& joint, double torque);

  /// Link angles at rest for readings q.
  Eigen::VectorXd at_rest(const Given& given, const Eigen::VectorXd& q, double t) const;

 private:
  const cell::Cell& cell_;
  std::vector<SoftJoint> soft_;
};

/// Flange poses of static postures, one after the other; asks the arm only when the posture changes.
class Postures {
 public:
  Postures(const Given& given, const FlangeAt& flange);
  /// T_B_F of a row.
  const Pose& flange(Eigen::Index row);

 private:
  const FlangeAt& flange_at_;
  Eigen::MatrixXd q_;
  Eigen::VectorXd t_;
  Eigen::Index last_ = -1;
  Pose T_B_F_;
};

}  // namespace kr5::predict
