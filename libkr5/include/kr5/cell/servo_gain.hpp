// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/io/csv.hpp>

namespace kr5::cell {

/// Column of a motion, where it is there: stiffness of all torque servos over that which the cell states [-], from its
/// row to the next. Gains of a firmware in several logs are such numbers. 0: the motors are off, and the servos give no
/// torque.
inline constexpr const char* servo_gain_column = "servo_gain";

/// That column of a motion; empty where it is not there and the gains are those of the cell.
inline Eigen::VectorXd servo_gain(const io::Table& motion) {
  return motion.find(servo_gain_column) < 0 ? Eigen::VectorXd() : Eigen::VectorXd(motion.column(servo_gain_column));
}

}  // namespace kr5::cell
