// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/identification/dynamics_model.hpp>

#include "joint_fit.hpp"

namespace kr5::identification {

/// Terms of each joint, with the further ones of friction_term_table() that predict torques on blocks of time that were
/// left out. Each block is predicted from the others by the weighted estimate of all parameters, links included, so
/// that a term counts by what links cannot imitate, and one that they imitate wholly is not offered. A term stays when
/// its mean gain over the blocks is above zero by Student's t on one side, at 5 % over the number of
/// kinds on offer (Bonferroni), and above a hundredth of what is left of its joint. Of terms within a standard error of
/// the best one that with the fewest parameters is taken.
/// @param rows Of the model without further terms; @param sigma Of the residuals of each joint.
/// @param load Torques through the gears, samples x joints; @param least_speed As in DynamicsOptions, and in `rows`.
std::vector<JointTerms> choose_friction_terms(const DynamicsModel& model, const JointMotion& motion,
                                              const JointRows& rows, const Eigen::VectorXd& sigma,
                                              const Eigen::MatrixXd& load, int blocks, double least_speed);

}  // namespace kr5::identification
