// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include <kr5/cell/cell.hpp>
#include <kr5/physics/joint_drive.hpp>
#include <kr5/physics/motors.hpp>

namespace kr5::physics {

/// Gears, motors and joint servos of a cell with their effects: the laws, without any state.
struct EffectiveDrives {
  std::vector<JointDrive> joints;
  std::optional<Motors> motors;          ///< Without drives in the cell there is no current, and no nominal friction.
  std::vector<cell::SecondOrder> servo;  ///< One a joint; empty when the cell has no joint servo.

  /// @throws InvalidArgument naming the field, as Motors and joint_servo do.
  explicit EffectiveDrives(const cell::Cell& cell);

  int size() const { return static_cast<int>(joints.size()); }
  const JointDrive& joint(Eigen::Index i) const { return joints[static_cast<std::size_t>(i)]; }
  bool rigid() const;
  /// Inertia of the rotors in joint coordinates [kg m^2 or kg]; zero without motors.
  Eigen::MatrixXd rotor_matrix() const;

  // At one instant, a value a joint:
  Eigen::VectorXd friction(const Eigen::VectorXd& position, const Eigen::VectorXd& speed, const Eigen::VectorXd& torque,
                           double t) const;
  Eigen::VectorXd ripple(const Eigen::VectorXd& q) const;
  Eigen::VectorXd cable(const Eigen::VectorXd& q) const;
  Eigen::VectorXd link(const Eigen::VectorXd& q) const;
  /// @throws InvalidArgument without motors; so does `torques`.
  Eigen::VectorXd currents(const Eigen::VectorXd& acceleration, const Eigen::VectorXd& torque) const;
  Eigen::VectorXd torques(const Eigen::VectorXd& currents) const;
  /// Torques through rigid gears: what rotors, ripple and friction leave of those of the motors.
  /// @throws InvalidArgument without motors.
  Eigen::VectorXd gear_torques(const Eigen::VectorXd& currents, const Eigen::VectorXd& position,
                               const Eigen::VectorXd& acceleration, const Eigen::VectorXd& friction) const;

  /// Torques that the drives give on the joint side over a motion, a row a sample: what the links and the dress pack
  /// ask (`load`), and what friction and ripple add at motor-side positions and speeds.
  Eigen::MatrixXd drive_torques(const Eigen::VectorXd& t, const Eigen::MatrixXd& position, const Eigen::MatrixXd& speed,
                                const Eigen::MatrixXd& load) const;
};

}  // namespace kr5::physics
