// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/cell/drives.hpp>

/// @file
/// Exact responses of a second-order servo, x'' = wn^2 (u - x) - 2 xi wn x'.

namespace kr5::physics {

/// Decay of position and speed within h seconds under a command of 0: the transition matrix.
Eigen::Matrix2d transition(const cell::SecondOrder& servo, double h);

/// Cubic to which the servo settles under a command c0 + c1 s + c2 s^2 + c3 s^3: a particular solution.
Eigen::Vector4d steady_response(const cell::SecondOrder& servo, const Eigen::Vector4d& command);

/// Acceleration at a position and a speed under a command [rad/s^2 or m/s^2].
inline double servo_acceleration(const cell::SecondOrder& servo, double command, double x, double v) {
  const double w = servo.natural_frequency;
  return w * w * (command - x) - 2 * servo.damping_ratio * w * v;
}

/// Response to a command that is smooth between the rows: a cubic spline through them (not-a-knot), and held before the
/// first, where the servo is at rest. `t` increases. Position, speed and acceleration, a row a sample.
Eigen::Matrix<double, Eigen::Dynamic, 3> follow_smooth(const cell::SecondOrder& servo,
                                                       const Eigen::Ref<const Eigen::VectorXd>& t,
                                                       const Eigen::Ref<const Eigen::VectorXd>& command);

/// The same to a command that is held from each row to the next, as a controller holds it over its cycle. The delay is
/// any number, also part of a cycle.
Eigen::Matrix<double, Eigen::Dynamic, 3> follow_held(const cell::SecondOrder& servo,
                                                     const Eigen::Ref<const Eigen::VectorXd>& t,
                                                     const Eigen::Ref<const Eigen::VectorXd>& command);

}  // namespace kr5::physics
