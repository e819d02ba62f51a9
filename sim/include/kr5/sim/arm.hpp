// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include <Eigen/Core>

#include <kr5/cell/cell.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// The arm of a cell as a DART skeleton: links, the tool welded on at the force/torque sensor, gravity, and the effects
/// that change what the arm is (lengths, twists, growth, base tilt, masses, payload). Drives are apart, in drives.hpp.

namespace kr5::sim {

/// What moves a joint.
enum class Actuation {
  Driven,  ///< The given acceleration; the torque is what that takes.
  Free,    ///< The given torque; the acceleration is what comes of it.
};

/// Forces and accelerations at one state of the arm.
struct ArmForces {
  Eigen::VectorXd acceleration;      ///< Of each joint [rad/s^2 or m/s^2].
  Eigen::VectorXd torque;            ///< On each joint [N m or N].
  Vector6 wrench = Vector6::Zero();  ///< What tool and contact apply on the sensor, in S [N, N m]. Zero without tool.
};

/// Joint values here are those of the links: true angles, encoder offsets and gears apart.
class Arm {
 public:
  /// @throws InvalidArgument naming the field when a mass or an inertia is not positive, or robot.links has not one
  /// link
  ///         a joint. Without any links the arm has its kinematics alone.
  explicit Arm(const cell::Cell& cell);
  ~Arm();
  Arm(Arm&&) noexcept;
  Arm& operator=(Arm&&) noexcept;

  int joints() const;
  bool has_masses() const;
  /// Time of the clock of slow effects, by which links grow [s].
  void set_clock(double t);
  /// @throws InvalidArgument when q or v has not one finite value a joint.
  void set_state(const Eigen::VectorXd& q, const Eigen::VectorXd& v);
  void set_state(const Eigen::VectorXd& q) { set_state(q, Eigen::VectorXd::Zero(q.size())); }
  const Eigen::VectorXd& positions() const;
  const Eigen::VectorXd& velocities() const;

  void set_actuation(int joint, Actuation actuation);
  /// Force and torque on the tool at the origin of S, in B [N, N m]; stays until it is set again.
  /// @throws InvalidArgument for a cell without tool.
  void set_contact(const Vector6& wrench);

  /// Forward dynamics at the state: acceleration of each driven and torque of each free joint are given. The forces are
  /// those of this state, not of the one before the step.
  /// @throws InvalidArgument for an arm without masses; so do all below.
  const ArmForces& solve(const Eigen::VectorXd& command);
  /// Torques and wrench for given accelerations of all joints, independent of their drive; faster.
  const ArmForces& inverse_dynamics(const Eigen::VectorXd& acceleration);
  /// Joint-space inertia without rotors, n x n [kg m^2, kg m or kg].
  const Eigen::MatrixXd& mass_matrix();
  /// Torque that holds Coriolis, gravity and contact at zero acceleration.
  const Eigen::VectorXd& bias_torque();
  /// Torque that holds the arm at rest in its posture, contact apart.
  Eigen::VectorXd gravity_torque();
  /// Kinetic and potential energy [J].
  double energy();

  /// Poses in B, which stays upright when the robot is tilted.
  Pose T_base_flange() const;
  Pose T_base_sensor() const;
  /// Velocity of the origin of S in B [m/s, rad/s].
  Vector6 sensor_velocity() const;

 private:
  struct Body;
  std::unique_ptr<Body> body_;
};

}  // namespace kr5::sim
