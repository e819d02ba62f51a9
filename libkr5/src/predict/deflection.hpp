// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/physics/gear_spring.hpp>

namespace kr5::predict {

/// Deflection of the links behind gears that give way, and its derivatives: N x m, one column a gear that gives way.
struct Deflection {
  Eigen::MatrixXd x, v, a;
};

/// How the load runs from row to row.
enum class LoadBetweenRows {
  Smooth,  ///< By a cubic spline, as that of motors that servos drive.
  Linear,  ///< As that of motors on a cubic spline through measured positions, whose acceleration is linear.
};

/// Solves M a + D v + spring(x) = -load over a motion, from rest, where `load` is what rigid joints would carry: the
/// equations of motion linearised about the motors' motion. Springs with free play are linear piece by piece.
/// @param t N times; @param load N x m torques; @param mass N mass matrices m x m, of their joints.
Deflection deflect(const std::vector<physics::GearSpring>& springs, const Eigen::VectorXd& t,
                   const Eigen::MatrixXd& load, const std::vector<Eigen::MatrixXd>& mass, LoadBetweenRows between);

}  // namespace kr5::predict
