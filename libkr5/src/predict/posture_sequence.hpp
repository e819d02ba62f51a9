// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/predict/static_kinds.hpp>

namespace kr5::predict {

/// Flange poses of static postures, one after the other; asks the arm only when the posture changes.
class PostureSequence {
 public:
  PostureSequence(const ExperimentInput& input, const FlangeAtRest& flange)
      : flange_at_rest_(flange), q_(input.joints("q")), t_(input["t"]), T_base_flange_(Pose::Identity()) {}

  /// Pose of the flange in a row.
  const Pose& T_base_flange(Eigen::Index row) {
    if (last_ < 0 || t_[row] != t_[last_] || q_.row(row) != q_.row(last_))
      T_base_flange_ = flange_at_rest_(q_.row(row).transpose(), t_[row]);
    last_ = row;
    return T_base_flange_;
  }

 private:
  const FlangeAtRest& flange_at_rest_;
  Eigen::MatrixXd q_;
  Eigen::VectorXd t_;
  Eigen::Index last_ = -1;
  Pose T_base_flange_;
};

}  // namespace kr5::predict
