// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/calibration/estimated_parameter.hpp>
#include <kr5/fit/problem.hpp>

/// @file
/// Private: the numbers of a fit as a result shows them.

namespace kr5::calibration::parameters {

struct ParameterReport {
  std::vector<EstimatedParameter> parameters;
  Eigen::MatrixXd covariance;  ///< In their order.
};

/// Of a solved fit. Blocks of `nominal` began at a nominal value, all others at a guess; a pose is told by its change.
/// Each variance is multiplied by its `inflation`, a covariance by the geometric mean of two.
ParameterReport report_parameters(const fit::Problem& fit, const fit::Solution& result,
                                  std::span<const fit::FitBlock> nominal, std::span<const fit::FitBlock> others,
                                  const Eigen::VectorXd& inflation);

/// That of each coordinate where one noise, with `dof` degrees of freedom behind it, makes all of them uncertain, for
/// regions of so many `numbers`.
Eigen::VectorXd same_inflation(const fit::Solution& result, double numbers, double dof);

/// The part of a covariance, in the order of the result's coordinates, that belongs to a pose; 0 for what is held.
Matrix6 covariance_of_pose(const fit::Solution& solution, fit::FitBlock pose, const Eigen::MatrixXd& covariance);

}  // namespace kr5::calibration::parameters
