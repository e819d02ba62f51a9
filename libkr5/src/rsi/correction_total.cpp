// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/correction_total.hpp>

#include <algorithm>
#include <cmath>

namespace kr5::rsi {
namespace {

constexpr double invisible = 1e-9;  // below what a telegram shows [rad or m]

bool beyond(double value, const std::optional<double>& limit) { return limit && value > *limit + invisible; }

Pose share_of_pose(const Pose& T, double share) { return to_pose(share * to_vector(T)); }

}  // namespace

CorrectionTotal::CorrectionTotal(const ControllerRules& rules, robot::CommandMode mode, robot::CommandFrame frame,
                                 int joints)
    : rules_((rules.validate(), rules)), mode_(mode), frame_(frame), joints_(robot::JointVector::Zero(joints)) {}

void CorrectionTotal::clear() noexcept {
  joints_.setZero();
  tool_ = Pose::Identity();
  limited_ = false;
}

Pose CorrectionTotal::corrected(const Pose& path) const noexcept {
  return robot::commanded_tool(robot::tool_motion(tool_, frame_), path);
}

double CorrectionTotal::limit_of(Eigen::Index joint) const noexcept {
  return joint < 6 ? rules_.axis_limit : rules_.external_limit;
}

ProgramStop CorrectionTotal::limit_joints(robot::JointVector& wanted) noexcept {
  for (Eigen::Index i = 0; i < wanted.size(); ++i) {
    const int axis = static_cast<int>(i) + 1;
    if (beyond(std::abs(wanted[i] - joints_[i]), rules_.axis_per_cycle)) return {ProgramStopReason::CycleLimit, axis};
    if (std::abs(wanted[i]) <= limit_of(i) + invisible) continue;
    if (rules_.at_limit == LimitAction::Stop) return {ProgramStopReason::AxisLimit, axis};
    wanted[i] = std::clamp(wanted[i], -limit_of(i), limit_of(i));
    limited_ = true;
  }
  return {};
}

ProgramStop CorrectionTotal::limit_tool(Pose& wanted) noexcept {
  const Vector6 step = to_vector(tool_.inverse() * wanted);
  if (beyond((wanted.translation() - tool_.translation()).norm(), rules_.translation_per_cycle) ||
      beyond(step.tail<3>().norm(), rules_.rotation_per_cycle))
    return {ProgramStopReason::CycleLimit};
  Vector6 total = to_vector(wanted);
  const double turn = total.tail<3>().norm(), far = total.head<3>().cwiseAbs().maxCoeff();
  const bool too_far = far > rules_.translation_limit + invisible,
             too_turned = turn > rules_.rotation_limit + invisible;
  if (!too_far && !too_turned) return {};
  if (rules_.at_limit == LimitAction::Stop)
    return {too_far ? ProgramStopReason::TranslationLimit : ProgramStopReason::RotationLimit};
  total.head<3>() = total.head<3>().cwiseMax(-rules_.translation_limit).cwiseMin(rules_.translation_limit);
  if (too_turned) total.tail<3>() *= rules_.rotation_limit / turn;
  wanted = to_pose(total);
  limited_ = true;
  return {};
}

ProgramStop CorrectionTotal::take(const Correction& received, double share) noexcept {
  const bool relative = mode_ == robot::CommandMode::Relative;
  limited_ = false;
  robot::JointVector joints = joints_;
  if (received.joints.size() == joints_.size())
    joints =
        relative ? robot::JointVector(joints_ + share * received.joints) : robot::JointVector(share * received.joints);
  Pose tool = tool_;
  if (received.tool) {
    const Pose part = share_of_pose(*received.tool, share);
    tool = relative ? robot::commanded_tool(robot::tool_motion(part, frame_), tool_) : part;
  }
  if (const ProgramStop stop = limit_joints(joints)) return stop;
  if (const ProgramStop stop = limit_tool(tool)) return stop;
  joints_ = joints;
  tool_ = tool;
  return {};
}

}  // namespace kr5::rsi
