// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/torque_smoothing.hpp>

#include <utility>
#include <vector>

#include <kr5/core/error.hpp>
#include <kr5/identification/dynamics.hpp>
#include <kr5/identification/joint_motion.hpp>

namespace kr5::identification {
namespace {

constexpr double left_out = 1.0 / 3.0;  // of the motions that are fitted
constexpr double margin = 0.95;         // share of the error with smoothing that torques as logged must stay below

/// Logs of which one part is fitted, and the other predicted.
struct SplitLogs {
  std::vector<JointLog> fit, check;
};

std::vector<ConditionedMotion> conditioned(const std::vector<JointLog>& logs, const ConditioningOptions& options) {
  std::vector<ConditionedMotion> out;
  for (const JointLog& log : logs) {
    out.push_back(condition_log(log, options));
    require(out.back().usable(), out.back().message);
  }
  return out;
}

JointMotion motion_of(const std::vector<ConditionedMotion>& parts) {
  std::vector<JointMotion> motions;
  for (const ConditionedMotion& part : parts) motions.push_back(part.motion);
  return merged_motion(motions);
}

Eigen::MatrixXd measured_torques(const std::vector<ConditionedMotion>& parts) {
  Eigen::Index rows = 0, at = 0;
  for (const ConditionedMotion& part : parts) rows += part.tau_measured.rows();
  Eigen::MatrixXd out(rows, parts.front().tau_measured.cols());
  for (const ConditionedMotion& part : parts) {
    out.middleRows(at, part.tau_measured.rows()) = part.tau_measured;
    at += part.tau_measured.rows();
  }
  return out;
}

/// Of the torques of the part left out, as they were logged, over their size; infinite where there is no answer.
double prediction_error(const SplitLogs& logs, ConditioningOptions options, const DynamicsModel& model, bool smooth) {
  options.smooth_torques = smooth;
  DynamicsOptions plain;
  plain.held_out = 0.0;
  try {
    const auto fit = conditioned(logs.fit, options);
    const auto check = conditioned(logs.check, conditioning_like(fit, options));
    const DynamicsResult result = identify_dynamics(motion_of(fit), model, plain);
    if (!result.fit.usable()) return std::numeric_limits<double>::infinity();
    return torque_error(measured_torques(check), predict_torques(result, motion_of(check))).total;
  } catch (const Error&) {
    return std::numeric_limits<double>::infinity();  // the log is refused when it is used
  }
}

}  // namespace

TorqueSmoothing choose_torque_smoothing(std::span<const JointLog> logs, const ConditioningOptions& options,
                                        const DynamicsModel& model) {
  require(!logs.empty(), "logs: expected at least one");
  SplitLogs parts;
  for (const JointLog& log : logs) {
    auto [first, last] = split_log(log, left_out);
    parts.fit.push_back(std::move(first));
    parts.check.push_back(std::move(last));
  }
  TorqueSmoothing out;
  out.error_smoothed = prediction_error(parts, options, model, true);
  out.error_logged = prediction_error(parts, options, model, false);
  out.smooth = !(out.error_logged < margin * out.error_smoothed);
  return out;
}

}  // namespace kr5::identification
