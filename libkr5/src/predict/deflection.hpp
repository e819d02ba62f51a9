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

/// Solves M a + D v + spring(x) = -load over a motion, from rest, where `load` is what rigid joints would carry: the
/// equations of motion linearised about the motors' motion. Springs with free play are linear piece by piece.
/// @param t N times; @param load N x m torques; @param mass N mass matrices m x m, of their joints.
Deflection deflect(const std::vector<physics::GearSpring>& springs, const Eigen::VectorXd& t,
                   const Eigen::MatrixXd& load, const std::vector<Eigen::MatrixXd>& mass);

}  // namespace kr5::predict
