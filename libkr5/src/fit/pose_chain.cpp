// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/pose_chain.hpp>

#include <kr5/core/error.hpp>

namespace kr5::fit {

PoseChain& PoseChain::then(const Pose& T) {
  factors_.push_back({.constant = T, .block = {}, .q = {}, .joint_terms = {}, .regressor = {}, .path = {}});
  return *this;
}
PoseChain& PoseChain::then(FitBlock pose) {
  factors_.push_back({.block = pose, .q = {}, .joint_terms = {}, .regressor = {}, .path = {}});
  return *this;
}
PoseChain& PoseChain::then_inverse(FitBlock pose) {
  factors_.push_back({.block = pose, .inverse = true, .q = {}, .joint_terms = {}, .regressor = {}, .path = {}});
  return *this;
}
PoseChain& PoseChain::then_arm(FitBlock arm, const Eigen::VectorXd& q, FitBlock joint_terms,
                               const Eigen::MatrixXd& regressor) {
  factors_.push_back({.block = arm, .q = q, .joint_terms = joint_terms, .regressor = regressor, .path = {}});
  return *this;
}
PoseChain& PoseChain::then_inverse_arm(FitBlock arm, const Eigen::VectorXd& q, FitBlock joint_terms,
                                       const Eigen::MatrixXd& regressor) {
  then_arm(arm, q, joint_terms, regressor);
  factors_.back().inverse = true;
  return *this;
}

PoseChain& PoseChain::then_path(const PosePath& path, double t, FitBlock delay) {
  require(static_cast<bool>(path), "PoseChain: there is no path");
  factors_.push_back({.block = delay, .q = {}, .joint_terms = {}, .regressor = {}, .path = path, .t = t});
  return *this;
}

}  // namespace kr5::fit
