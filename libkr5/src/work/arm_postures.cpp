// SPDX-License-Identifier: BSD-3-Clause
#include "work/arm_postures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace kr5::work {
namespace {

using Eigen::VectorXd;

constexpr double step_length = 0.06;  // of the tool, in which its joints are followed [m]
constexpr double step_angle = 0.2;    // [rad]
constexpr double longest_step = 0.6;  // of a joint in such a step; beyond it a singularity is near [rad or m]
constexpr double full_turn = 2 * std::numbers::pi;

}  // namespace

ArmPostures::ArmPostures(const cell::Cell& believed, double margin)
    : chain_(cell::nominal_chain(believed)),
      T_flange_tool_(believed.tool->T_flange_tool),
      T_tool_flange_(T_flange_tool_.inverse()) {
  const Eigen::Index n = believed.robot.joints();
  constexpr double inf = std::numeric_limits<double>::infinity();
  lower_ = VectorXd::Constant(n, -inf);
  upper_ = VectorXd::Constant(n, inf);
  options_.near = VectorXd::Zero(n);
  if (!believed.robot.limits) return;
  options_.lower = believed.robot.limits->lower;
  options_.upper = believed.robot.limits->upper;
  lower_ = options_.lower.array() + margin;
  upper_ = options_.upper.array() - margin;
}

std::optional<VectorXd> ArmPostures::posture_near(const Pose& T_base_tool, const VectorXd& near) const {
  kinematics::InverseOptions options = options_;
  options.near = near;
  const auto found = kinematics::inverse_kinematics(chain_, T_base_tool * T_tool_flange_, options);
  std::optional<VectorXd> best;  // not found.nearest(): the joint with the longest way decides how long it takes
  for (const kinematics::Posture& p : found.postures)
    if (p.usable() && (!best || (p.q - near).lpNorm<Eigen::Infinity>() < (*best - near).lpNorm<Eigen::Infinity>()))
      best = p.q;
  return best;
}

std::optional<VectorXd> ArmPostures::followed(const VectorXd& from, const Pose& T_base_tool) const {
  const Pose begin = tool(from);
  const Eigen::Vector3d way = T_base_tool.translation() - begin.translation();
  const Eigen::Vector3d turn = log_rotation(begin.linear().transpose() * T_base_tool.linear());
  const int steps =
      std::max(1, static_cast<int>(std::ceil(std::max(way.norm() / step_length, turn.norm() / step_angle))));
  VectorXd q = from;
  for (int k = 1; k <= steps; ++k) {
    const double share = static_cast<double>(k) / steps;
    Pose T = T_base_tool;
    if (k < steps) {
      T.translation() = begin.translation() + share * way;
      T.linear() = begin.linear() * exp_rotation(share * turn);
    }
    const auto next = posture_near(T, q);
    if (!next || (*next - q).lpNorm<Eigen::Infinity>() > longest_step) return std::nullopt;
    q = *next;
  }
  return q;
}

/// All turns of a posture in which it and what is near it keep the margin. @param low, high Joints near it.
void ArmPostures::add_turns(const VectorXd& q, const VectorXd& low, const VectorXd& high, bool neutral,
                            std::vector<VectorXd>& out) const {
  std::vector<VectorXd> found{q};
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const bool revolute = chain_.joints[static_cast<std::size_t>(i)].type == kinematics::JointType::Revolute;
    std::vector<VectorXd> turned;
    for (const int turns : {-1, 0, 1}) {
      const double shift = turns * full_turn;
      if (turns != 0 && (!revolute || !std::isfinite(lower_[i]) || !std::isfinite(upper_[i]))) continue;
      if (low[i] + shift < lower_[i] || high[i] + shift > upper_[i]) continue;
      const bool may_turn = upper_[i] - lower_[i] > full_turn;
      if (neutral && may_turn && std::abs(q[i] + shift) > 0.5 * full_turn) continue;
      for (VectorXd other : found) {
        other[i] += shift;
        turned.push_back(other);
      }
    }
    found = std::move(turned);
  }
  out.insert(out.end(), found.begin(), found.end());
}

std::vector<VectorXd> ArmPostures::postures(const ArmStop& stop) const {
  std::vector<VectorXd> out;
  const auto found = kinematics::inverse_kinematics(chain_, stop.T_base_over * T_tool_flange_, options_);
  for (const kinematics::Posture& p : found.postures) {
    if (!p.usable()) continue;
    VectorXd low = p.q, high = p.q;
    const bool reached = std::all_of(stop.near.begin(), stop.near.end(), [&](const Pose& near) {
      const auto q = followed(p.q, near);
      if (!q) return false;
      low = low.cwiseMin(*q);
      high = high.cwiseMax(*q);
      return true;
    });
    if (reached) add_turns(p.q, low, high, stop.neutral, out);
  }
  return out;
}

bool ArmPostures::within(const VectorXd& q, const VectorXd& begin, const VectorXd& end) const {
  const Eigen::ArrayXd low = lower_.cwiseMin(begin).cwiseMin(end), high = upper_.cwiseMax(begin).cwiseMax(end);
  return (q.array() >= low).all() && (q.array() <= high).all();
}

}  // namespace kr5::work
