// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/cell/drives.hpp>

/// @file
/// Exact responses of x'' = wn^2 (u - x) - 2 xi wn x', at rest before the first row.

namespace kr5::predict {

/// Position, speed and acceleration, one row a sample; one column an axis.
struct Response {
  Eigen::MatrixXd x, v, a;
};

/// How position and speed decay within h seconds when the command is 0.
Eigen::Matrix2d transition(const cell::SecondOrder& servo, double h);

/// Response to a command that is smooth between the rows: a cubic spline through them (not-a-knot), and held before the
/// first. `t` increases. Position, speed and acceleration, a row a sample.
Eigen::Matrix<double, Eigen::Dynamic, 3> follow_smooth(const cell::SecondOrder& servo,
                                                       const Eigen::Ref<const Eigen::VectorXd>& t,
                                                       const Eigen::Ref<const Eigen::VectorXd>& command);

}  // namespace kr5::predict
