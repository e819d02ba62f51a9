// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/cell/cell.hpp>

namespace kr5::predict {

/// Motion of an arm under its torque servos: motor side, a row an instant, a column a joint.
struct ServoMotion {
  Eigen::MatrixXd x, v, a;  ///< [rad or m], per s, per s^2
  Eigen::MatrixXd torque;   ///< Of the servos, on the joint side [N m or N].
};

/// Moves an arm from rest at `start` by commands at times t, all joints coupled through rigid gears. `gain`: of the
/// servos from each row to the next (cell::servo_gain_column); empty: 1.
///
/// Steps of two implicit stages: second order, stable for any stiffness, and without swings that are faster than a
/// step. Dry friction is a set: it holds a joint until more than its level pulls, and is found for all joints together.
/// Commands act by their mean over a step, so that motions change smoothly with a delay.
/// @throws InvalidArgument naming the field, for elastic gears, for play, and for links without mass and rotors.
ServoMotion move_by_servos(const cell::Cell& cell, const Eigen::VectorXd& t, const Eigen::MatrixXd& command,
                           const Eigen::VectorXd& start, const Eigen::VectorXd& gain = {});

}  // namespace kr5::predict
