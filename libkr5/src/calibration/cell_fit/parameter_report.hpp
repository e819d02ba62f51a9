// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/calibration/estimated_parameter.hpp>
#include <kr5/fit/cell_fit.hpp>

/// @file
/// Private: the numbers of a cell fit as a result shows them.

namespace kr5::calibration::cell_fit {

struct ParameterReport {
  std::vector<EstimatedParameter> parameters;
  Eigen::MatrixXd covariance;  ///< In their order.
};

/// Of a solved fit. Blocks of `nominal` began at a nominal value, all others at a guess; a pose is told by its change.
/// Each variance is multiplied by its `inflation`, a covariance by the geometric mean of two.
ParameterReport report_parameters(const fit::CellFit& fit, const fit::CellFitResult& result,
                                  std::span<const fit::FitBlock> nominal, std::span<const fit::FitBlock> others,
                                  const Eigen::VectorXd& inflation);

/// That of each coordinate where one noise, with `dof` degrees of freedom behind it, makes all of them uncertain, for
/// regions of so many `numbers`.
Eigen::VectorXd same_inflation(const fit::CellFitResult& result, double numbers, double dof);

/// The part of a covariance, in the order of the result's coordinates, that belongs to a pose; 0 for what is held.
Matrix6 covariance_of_pose(const fit::CellFit& fit, fit::FitBlock pose, const Eigen::MatrixXd& covariance);

}  // namespace kr5::calibration::cell_fit
