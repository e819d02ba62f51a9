// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace kr5::physics {

using SplinePieces = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>;

/// Cubic spline through the points (t, y), its third derivative continuous at the second and the last but one (not-a-
/// knot). Row k: coefficients c0 c1 c2 c3 of y = c0 + c1 s + c2 s^2 + c3 s^3, s = t - t[k]. `t` increases; with fewer
/// than four points the parabola or line through them.
SplinePieces cubic_spline(const Eigen::Ref<const Eigen::VectorXd>& t, const Eigen::Ref<const Eigen::VectorXd>& y);

/// Value of one piece, s after its beginning.
template <class Row>
double spline_value(const Row& piece, double s) {
  return piece[0] + s * (piece[1] + s * (piece[2] + s * piece[3]));
}

/// Value, slope and curvature of the spline through the points at each of them, a row a point: the motion of an axis
/// that passes through measured positions.
Eigen::Matrix<double, Eigen::Dynamic, 3> spline_motion(const Eigen::Ref<const Eigen::VectorXd>& t,
                                                       const Eigen::Ref<const Eigen::VectorXd>& y);

/// Value, slope and curvature of one piece, s after its beginning.
template <class Row>
Eigen::Vector3d spline_state(const Row& piece, double s) {
  return {spline_value(piece, s), piece[1] + s * (2 * piece[2] + s * 3 * piece[3]), 2 * piece[2] + s * 6 * piece[3]};
}

}  // namespace kr5::physics
