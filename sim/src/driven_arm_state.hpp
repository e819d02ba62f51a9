// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <kr5/physics/effective_drives.hpp>
#include <kr5/physics/servo_bank.hpp>
#include <kr5/sim/driven_arm.hpp>

namespace kr5::sim {

/// A duration in messages.
std::string milliseconds(double seconds);

/// What steps an arm: `follow` (ideal servos) and `velocity_update` (motors under currents).
struct DrivenArm::State {
  using Index = Eigen::Index;
  using MatrixXd = Eigen::MatrixXd;
  using VectorXd = Eigen::VectorXd;

  Arm arm;
  physics::EffectiveDrives drives;
  DrivenArmOptions options;
  double step = 0.0, t = 0.0;
  physics::ServoBank servo;
  MatrixXd rotors;
  std::vector<Index> elastic;
  bool loaded = false;  ///< Some friction needs the torque through its gear.
  Environment environment;

  VectorXd x, v, a;               ///< Motor side.
  VectorXd q, qd, qdd;            ///< Links.
  VectorXd inertia;               ///< Diagonal of the mass matrix, for the dampers of the gears.
  VectorXd current, dry, torque;  ///< Of the last step under currents; torque through the gears.
  double looked_up = 0.0;
  bool ideal = true, limited = false, fresh = false;
  ArmReading reading;

  State(const cell::Cell& cell, const DrivenArmOptions& given);

  const physics::JointDrive& joint(Index i) const { return drives.joint(i); }
  /// Links of rigid gears go where the motor side is.
  void place_rigid();
  double spring_torque(Index i, double link, double link_speed) const;
  /// The arm at (positions, speeds), touched by its environment.
  void pose_arm(const VectorXd& positions, const VectorXd& speeds);
  /// Accelerations of the links at (q, speeds): rigid joints driven, elastic ones by their springs.
  const ArmForces& solve(const VectorXd& speeds);
  void look_up_inertia();

  /// Fastest resonance of the gears at a posture [rad/s], and the greatest damping ratio.
  double fastest(const VectorXd& position, double* ratio);
  double stable_step(const VectorXd& position);
  void choose_step(const VectorXd& position);
  void set_step(double given);

  void reset(const VectorXd& position, double start);
  /// Elastic links to where their springs balance their load, the torques at given link values.
  void settle(const std::function<VectorXd(const VectorXd&)>& load);
  /// Velocity Verlet with the speed in the forces predicted: second order, one evaluation a step.
  void follow(const VectorXd& command);
  void begin_motion(const Eigen::MatrixX3d& motor);
  void move_to(const Eigen::MatrixX3d& motor);

  /// Motion under currents, in coordinates z = (motor side of every joint, links of elastic joints).
  struct Equations {
    MatrixXd H;    ///< Inertia.
    VectorXd rhs;  ///< All forces but motors and dry friction.
  };
  /// A point between two steps.
  struct Point {
    VectorXd x, v, q, qd;
  };
  Point middle() const;
  Equations equations(const Point& at);
  void add_springs(const Point& at, Equations& e);
  VectorXd stacked(const VectorXd& motor, const VectorXd& link) const;
  void unstack(const VectorXd& z, VectorXd& motor, VectorXd& link) const;
  double speed_friction(Index i, double speed) const;
  physics::FrictionRange dry_friction(Index i, const Point& at) const;
  /// Drift, velocity_update, drift; `currents_at` gives the motor currents at the middle of the step.
  void velocity_update(const std::function<VectorXd(const Equations&, const Point&)>& currents_at);
  void note_torque();
  VectorXd limited_currents(const Equations& e, const VectorXd& command, const Point& at);

  const ArmReading& read();
  double energy();
  DrivenArmState state() const;
  void restore(const DrivenArmState& from);
};

}  // namespace kr5::sim
