// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/random.hpp>
#include <kr5/robot/cycle.hpp>

#include "gap/planning/proposal.hpp"

namespace kr5::gap {

/// Where the arm may go: within its limits and not below where it was recorded.
struct Workspace {
  explicit Workspace(const Family& family);

  bool contains_path(const Eigen::MatrixXd& path) const;  ///< One posture a row.
  /// A posture within `reach` of a middle [rad or m], random.
  Eigen::VectorXd random_near(Random& random, const Eigen::VectorXd& middle, double reach) const;
  /// Of many random postures that with the flange farthest from (or nearest to) the axis of joint 1.
  Eigen::VectorXd random_extreme(Random& random, bool far) const;

  const cell::Cell& cell;
  double cycle;               ///< [s]
  Eigen::VectorXd low, high;  ///< [rad or m]
  Eigen::VectorXd speed;      ///< [rad/s or m/s]
  Eigen::VectorXd home;       ///< Where the recorded motion began.
  double floor = -1e9;        ///< Least height of the tool tip in B [m].
};

}  // namespace kr5::gap
