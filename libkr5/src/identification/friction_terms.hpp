// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/identification/dynamics_model.hpp>

namespace kr5::identification {

/// Terms of each joint, with the further ones that predict its residuals on blocks of time that were left out. A term
/// stays when its mean gain over the blocks exceeds the standard error of that mean. The links stay as estimated, so a
/// term that they can imitate on this motion, such as an offset beside gravity, is not found.
/// @param residuals Of an estimate with the terms of `model`, samples x joints; @param load Torques through the gears.
/// @param least_speed As in DynamicsOptions; the residuals of samples that are left out are zero.
std::vector<JointTerms> choose_friction_terms(const DynamicsModel& model, const JointMotion& motion,
                                              const Eigen::MatrixXd& residuals, const Eigen::MatrixXd& load, int blocks,
                                              double least_speed);

}  // namespace kr5::identification
