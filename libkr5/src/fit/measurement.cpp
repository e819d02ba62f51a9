// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/measurement.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/geometry/pose_derivatives.hpp>

#include "fit/block.hpp"

namespace kr5::fit {

void BlockUse::use(FitBlock block) {
  if (block.exists() && std::find(blocks_.begin(), blocks_.end(), block.index) == blocks_.end())
    blocks_.push_back(block.index);
}

void BlockUse::chain(const PoseChain& chain) {
  for (const PoseChain::Factor& factor : chain.factors()) {
    if (factor.path) require(std::isfinite(factor.t), "PoseChain: the time on a path must be finite [s]");
    if (!factor.block.exists()) continue;
    use(factor.block), use(factor.joint_terms);
    if (factor.path) {
      require(block_of(*all_, factor.block, BlockKind::Vector, "delay").size() == 1,
              "delay must be a block of one number");
      continue;
    }
    if (factor.q.size() == 0) {
      block_of(*all_, factor.block, BlockKind::Pose, "pose");
      continue;
    }
    const Block& arm = block_of(*all_, factor.block, BlockKind::Arm, "arm");
    const auto joints = static_cast<Eigen::Index>(arm.chain.joints.size());
    require(factor.q.size() == joints && factor.q.allFinite(), arm.name + ": expected " + std::to_string(joints) +
                                                                   " finite joint values, found " +
                                                                   std::to_string(factor.q.size()));
    if (factor.joint_terms.exists())
      require(factor.regressor.rows() == joints &&
                  factor.regressor.cols() == block_of(*all_, factor.joint_terms).size() && factor.regressor.allFinite(),
              arm.name + ": the regressor of the joint terms must be finite, joints x coefficients");
  }
}

void BlockUse::point(const FitPoint& point) {
  use(point.block);
  if (point.block.exists())
    block_of(*all_, point.block, BlockKind::Point, "point");
  else
    require(point.value.allFinite(), "a point must be finite [m]");
}

void BlockUse::number(const FitNumber& number, const char* name) {
  use(number.block);
  if (number.block.exists())
    require(block_of(*all_, number.block).size() == 1, std::string(name) + " must be a block of one number");
}

void BlockUse::camera(FitBlock camera) {
  use(camera);
  block_of(*all_, camera, BlockKind::Camera, "camera");
}

void BlockUse::vector(FitBlock vector, Eigen::Index size, const std::string& expected) {
  use(vector);
  require(block_of(*all_, vector, BlockKind::Vector, "vector").size() == size, expected);
}

std::size_t Evaluation::place(FitBlock block) const {
  return static_cast<std::size_t>(std::find(blocks_->begin(), blocks_->end(), block.index) - blocks_->begin());
}

Eigen::Vector3d Evaluation::point(const FitPoint& point) const {
  return point.block.exists() ? Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(values(point.block))) : point.value;
}

Pinhole Evaluation::camera(FitBlock block) const {
  Pinhole out;
  out.set_parameters(Eigen::Map<const Pinhole::Parameters>(values(block)));
  return out;
}

Eigen::Map<RowMatrix, 0, Eigen::OuterStride<>> Evaluation::by(FitBlock block) const {
  const Block& b = (*all_)[static_cast<std::size_t>(block.index)];
  return {jacobians_[place(block)], rows_, b.size(), Eigen::OuterStride<>(b.values.size())};
}

ChainState::Factor Evaluation::arm_state(const PoseChain::Factor& factor) const {
  ChainState::Factor out;
  const Block& block = (*all_)[static_cast<std::size_t>(factor.block.index)];
  const kinematics::DhChain arm = to_arm(block.chain, values(factor.block));
  Eigen::VectorXd q = factor.q;
  const bool terms = factor.joint_terms.exists();
  if (terms)
    q += factor.regressor * Eigen::Map<const Eigen::VectorXd>(values(factor.joint_terms), factor.regressor.cols());
  if (!wanted(factor.block) && !wanted(factor.joint_terms)) {
    out.T = arm.flange(q);
    return out;
  }
  out.by_block = kinematics::parameter_jacobian(arm, q, &out.T);
  if (!terms) return out;
  kinematics::Jacobian by_q(6, q.size());
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const bool revolute = arm.joints[static_cast<std::size_t>(i)].type == kinematics::JointType::Revolute;
    by_q.col(i) = out.by_block.col(5 * i + (revolute ? 1 : 0));
  }
  out.by_terms = by_q * factor.regressor;
  return out;
}

/// Empty where the path has no pose.
std::optional<ChainState::Factor> Evaluation::path_state(const PoseChain::Factor& factor) const {
  const double delay = factor.block.exists() ? *values(factor.block) : 0.0;
  const std::optional<PathSample> sample = factor.path(factor.t - delay);
  if (!sample) return std::nullopt;
  ChainState::Factor out;
  out.T = sample->T;
  if (wanted(factor.block)) out.by_block = -sample->rate;
  return out;
}

std::optional<ChainState::Factor> Evaluation::factor_state(const PoseChain::Factor& factor) const {
  ChainState::Factor out;
  if (factor.path) {
    const auto on_path = path_state(factor);
    if (!on_path) return std::nullopt;
    out = *on_path;
  } else if (!factor.block.exists()) {
    out.T = factor.constant;
    return out;
  } else if (factor.q.size() > 0) {
    out = arm_state(factor);
  } else {
    out.T = to_pose_block(values(factor.block));
  }
  if (!factor.inverse) return out;
  if (derivatives()) {
    const Matrix6 across = -adjoint(out.T);  // (T exp(d))^-1 = T^-1 exp(-Ad(T) d)
    if (factor.q.size() == 0) out.by_block = across;
    if (factor.q.size() > 0 && out.by_block.size()) out.by_block = across * out.by_block;
    if (out.by_terms.size()) out.by_terms = across * out.by_terms;
  }
  out.T = out.T.inverse();
  return out;
}

std::optional<ChainState> Evaluation::state(const PoseChain& chain) const {
  ChainState out;
  out.chain = &chain;
  out.factors.reserve(chain.factors().size());
  for (const PoseChain::Factor& factor : chain.factors()) {
    auto state = factor_state(factor);
    if (!state) return std::nullopt;
    out.T = out.T * state->T;
    out.factors.push_back(std::move(*state));
  }
  return out;
}

void Evaluation::add(const ChainState& state, const Eigen::Matrix<double, Eigen::Dynamic, 6>& by_chain) const {
  if (!derivatives()) return;
  Pose rest = Pose::Identity();
  const auto& factors = state.chain->factors();
  for (std::size_t k = factors.size(); k-- > 0;) {
    const ChainState::Factor& factor = state.factors[k];
    const bool block = wanted(factors[k].block), terms = wanted(factors[k].joint_terms);
    if (block || terms) {
      const Matrix6 across = adjoint(rest.inverse());
      if (block && factor.by_block.size())
        add(factors[k].block, by_chain * (across * factor.by_block));
      else if (block && k + 1 < factors.size())
        add(factors[k].block, by_chain * across);
      else if (block)
        add(factors[k].block, by_chain);
      if (terms) add(factors[k].joint_terms, by_chain * (across * factor.by_terms));
    }
    if (k > 0) rest = factor.T * rest;
  }
}

int Measurement::condensed_rows(const std::function<bool(FitBlock)>&) const { return rows(); }

void Measurement::set_covariance(const Eigen::MatrixXd&) {
  throw InvalidArgument("this kind of measurement has no covariance");
}

Eigen::Matrix<double, 3, 6> point_by_pose(const Pose& T, const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 3, 6> out;
  out << T.linear(), -T.linear() * skew(p);
  return out;
}

}  // namespace kr5::fit
