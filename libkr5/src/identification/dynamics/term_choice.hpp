// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/identification/dynamics_model.hpp>

#include "identification/dynamics/joint_fit.hpp"

namespace kr5::identification {

/// Terms of each joint, with the further ones of friction_term_table() that predict torques on blocks of time that were
/// left out. Each block is predicted from the others by the weighted estimate of all parameters, links included, so
/// that a term counts by what links cannot imitate, and one that they imitate wholly is not offered. A term is added
/// when its parameters differ from zero by the jackknife over the blocks, at 5 % over the number of offers to its joint
/// (Bonferroni), when it lowers the squared errors of the blocks by a hundredth of those of a joint, and when dry
/// friction does not surely drive, nor grow as a gear warms up. The one that gains most comes first, over all joints;
/// of offers to a joint within a standard error of the best one that with the fewest parameters is taken. What differs
/// from zero no longer beside a later term is taken away.
/// @param rows Of the model without further terms; @param sigma Of the residuals of each joint.
/// @param load Torques through the gears, samples x joints; @param min_speed As in DynamicsOptions, and in `rows`.
std::vector<JointTerms> choose_friction_terms(const DynamicsModel& model, const JointMotion& motion,
                                              const JointRows& rows, const Eigen::VectorXd& sigma,
                                              const Eigen::MatrixXd& load, int blocks, double min_speed);

/// Takes away the most doubtful of the chosen terms, unless the 95 % regions of all lie off zero: blocks that are short
/// beside the correlation of the residuals do not tell that.
/// @param given Model before the choice; @param terms As chosen, of the model that `base` and `fit` belong to.
bool take_doubtful_term(const DynamicsModel& given, const BaseParameters& base, const JointFit& fit,
                        std::vector<JointTerms>& terms);

}  // namespace kr5::identification
