// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include <kr5/kinematics/inverse.hpp>

namespace kr5::kinematics {

/// All postures of an arm with a spherical wrist, angles in [-pi, pi], limits and errors not yet filled; nothing for
/// other chains.
std::optional<std::vector<Posture>> closed_form(const DhChain& chain, const Pose& T_base_flange,
                                                const Eigen::VectorXd& near, double within);

}  // namespace kr5::kinematics
