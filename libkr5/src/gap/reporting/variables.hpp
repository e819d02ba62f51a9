// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/gap/dependence.hpp>

#include "gap/comparison_data.hpp"

namespace kr5::gap {

struct Group;

/// What a residual may depend on, over all samples of a column.
struct VariableValues {
  Variable variable;
  std::string unit;
  Eigen::VectorXd values;
  Eigen::VectorXd sign = {};  ///< Direction of motion of its joint, for what acts against it; empty: there is none.
};

/// Given columns, rates and accelerations of commands, image coordinates, and what the simulator predicts for the
/// column.
std::vector<VariableValues> variables(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted);

/// Velocity of a joint (from 0) in each row, from its commanded or measured course; empty where there is none.
/// [rad/s or m/s]
Eigen::VectorXd velocity(const cell::Experiment& experiment, int joint);

}  // namespace kr5::gap
