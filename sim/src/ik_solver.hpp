// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <kr5/cell/cell.hpp>
#include <kr5/kinematics/inverse.hpp>

namespace kr5::sim {

/// Inverse kinematics of the nominal arm of a cell, within its limits.
class IkSolver {
 public:
  explicit IkSolver(const cell::Cell& cell);

  /// The posture within the limits that is nearest to `near`, if there is one.
  std::optional<Eigen::VectorXd> posture(const Pose& T_base_flange, const Eigen::VectorXd& near);
  /// How the last search ended.
  kinematics::InverseStatus status() const { return status_; }
  const kinematics::DhChain& chain() const { return chain_; }

 private:
  kinematics::DhChain chain_;
  kinematics::InverseOptions options_;
  kinematics::InverseStatus status_ = kinematics::InverseStatus::Solved;
};

}  // namespace kr5::sim
