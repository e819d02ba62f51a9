// SPDX-License-Identifier: BSD-3-Clause
#include "command_checks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <kr5/cell/servo_gain.hpp>
#include <kr5/core/statistics.hpp>

#include "joint_columns.hpp"

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr Index fewest_command_rows = 100;
constexpr Index most_shift = 3;          // rows, by which a logger may store the next measurement as the command
constexpr double equal_share = 1e-6;     // of the range of a joint: what is no more is equal
constexpr double commanded = 0.1;        // range from which a command moves a joint [rad or m]
constexpr double standing = 0.03;        // of the range of its command, within which a joint does not move
constexpr double still = 0.01;           // range of a joint that does not move [rad or m]
constexpr double longest_lag = 0.6;      // of a position behind its command [s]
constexpr double window = 0.2;           // over which changes of the position are compared with speeds [s]
constexpr double surely_alike = 0.97;    // correlation of what is the same but for unit and zero
constexpr double clearly_less = 0.5;     // of the variance that another explanation leaves
constexpr double hardly_alike = 0.5;     // below which one has nothing to do with another
constexpr double most_gain = 1.5;        // of a servo over its command
constexpr double least_gain = 0.1;       // of a weak servo that gravity holds
constexpr double other_zero = 0.5;       // distance of two zeros [rad or m]
constexpr double lost_over_usual = 5.0;  // error of a joint without its motor, over the usual one
constexpr double lost = 0.2;             // the same [rad or m]
constexpr double shortest_loss = 0.5;    // [s]

double span_of(const Eigen::Ref<const VectorXd>& x) { return x.maxCoeff() - x.minCoeff(); }

double likeness(const Eigen::Ref<const VectorXd>& a, const Eigen::Ref<const VectorXd>& b) {
  const VectorXd x = a.array() - a.mean(), y = b.array() - b.mean();
  const double size = x.norm() * y.norm();
  return size > 0 ? x.dot(y) / size : 0.0;
}

/// A joint and the command that it should follow, `lag` rows later, where the two are most alike.
struct Following {
  Index lag = 0;
  double correlation = 0.0;
  double gain = 1.0;
  double offset = 0.0;  // of the position where the command is zero [rad or m]
};

Following best_following(const VectorXd& q, const VectorXd& qc, Index most_lag) {
  Following out;
  for (Index lag = 0; lag <= most_lag; lag = lag < 4 ? lag + 1 : lag + lag / 4) {
    const Index n = q.size() - lag;
    const double found = likeness(q.tail(n), qc.head(n));
    if (lag > 0 && std::abs(found) <= std::abs(out.correlation)) continue;
    out.lag = lag, out.correlation = found;
  }
  const Index n = q.size() - out.lag;
  const VectorXd x = qc.head(n), y = q.tail(n);
  const VectorXd centred = x.array() - x.mean();
  out.gain = centred.dot(y) / centred.squaredNorm();
  out.offset = y.mean() - out.gain * x.mean();
  return out;
}

/// The motion of an experiment while its motors are on, rows x joints, with the joints whose command moves; where none
/// does, those that move by themselves.
struct Motion {
  VectorXd t;
  MatrixXd q, qc;
  std::vector<int> moving;
  std::vector<Following> followings;  // of each moving joint
  Index rows_in(double seconds) const {
    const double step = (t[t.size() - 1] - t[0]) / static_cast<double>(t.size() - 1);
    return std::clamp<Index>(static_cast<Index>(seconds / std::max(step, 1e-9)), 1, t.size() / 4);
  }
};

/// An experiment without the rows in which its motors are off.
cell::Experiment while_on(cell::Experiment experiment) {
  const VectorXd gain = cell::servo_gain(experiment.data);
  if (gain.size() == 0) return experiment;
  std::vector<Index> on;
  for (Index i = 0; i < gain.size(); ++i)
    if (gain[i] > 0.0) on.push_back(i);
  experiment.data.values = experiment.data.values(on, Eigen::all).eval();
  return experiment;
}

std::optional<Motion> commanded_motion(const cell::Cell& cell, const cell::Experiment& experiment) {
  const bool both = has_column(experiment, "qc1") && has_column(experiment, "q1");
  if (experiment.kind != cell::Kind::Motion || !both || experiment.data.values.rows() < fewest_command_rows) return {};
  const int n = cell.robot.joints();
  // Also what is simulated and not judged was measured.
  const cell::Experiment whole = while_on(cell::with_lead_in(experiment));
  if (whole.data.values.rows() < fewest_command_rows) return {};
  Motion out{whole.data.column("t"), joint_columns(whole, "q", n), joint_columns(whole, "qc", n), {}, {}};
  for (int k = 0; k < n; ++k)
    if (span_of(out.qc.col(k)) >= commanded) out.moving.push_back(k);
  if (out.moving.empty())
    for (int k = 0; k < n; ++k)
      if (span_of(out.q.col(k)) >= commanded && span_of(out.qc.col(k)) > 0) out.moving.push_back(k);
  for (const int k : out.moving)
    out.followings.push_back(best_following(out.q.col(k), out.qc.col(k), out.rows_in(longest_lag)));
  return out;
}

std::vector<std::string> all_columns(const std::string& family, Index joints) {
  std::vector<std::string> out;
  for (Index k = 1; k <= joints; ++k) out.push_back(family + std::to_string(k));
  return out;
}

LogProblem of_commands(LogProblemKind kind, LogRemedy remedy, const Motion& motion) {
  return {.kind = kind, .remedy = remedy, .columns = all_columns("qc", motion.q.cols())};
}

/// Commands that are what was measured, or is measured some rows later.
std::optional<LogProblem> equal_commands(const Motion& motion) {
  for (Index shift = 0; shift <= most_shift; ++shift) {
    const Index n = motion.q.rows() - shift;
    const bool equal = std::all_of(motion.moving.begin(), motion.moving.end(), [&](int k) {
      const VectorXd off = (motion.qc.col(k).head(n) - motion.q.col(k).tail(n)).cwiseAbs();
      return off.maxCoeff() <= equal_share * span_of(motion.qc.col(k));
    });
    if (!equal) continue;
    LogProblem out = of_commands(LogProblemKind::CommandsMeasured, LogRemedy::UseMeasured, motion);
    out.found = static_cast<double>(shift);
    return out;
  }
  return std::nullopt;
}

/// Correlation of the speed of a joint with its commands, both over a window, best lag as of a position.
double likeness_to_speed(const Motion& motion, int joint) {
  const Index w = motion.rows_in(window), n = motion.q.rows() - w;
  VectorXd change(n), command(n);
  for (Index i = 0; i < n; ++i) {
    change[i] = motion.q(i + w, joint) - motion.q(i, joint);
    command[i] = motion.qc.col(joint).segment(i, w).mean();
  }
  return best_following(change, command, motion.rows_in(longest_lag)).correlation;
}

double unexplained(double correlation) { return 1 - correlation * correlation; }

/// Commands that explain the speeds of the joints better than their positions. A weak servo leaves a part of both
/// unexplained, so that neither correlation tells by itself.
std::optional<LogProblem> speed_commands(const Motion& motion) {
  double of_speeds = 0.0, of_positions = 0.0, least = 1.0;
  for (std::size_t m = 0; m < motion.moving.size(); ++m) {
    const double found = std::abs(likeness_to_speed(motion, motion.moving[m]));
    of_speeds += unexplained(found);
    of_positions += unexplained(motion.followings[m].correlation);
    least = std::min(least, found);
  }
  if (of_speeds > clearly_less * of_positions) return std::nullopt;
  LogProblem out = of_commands(LogProblemKind::CommandsAreSpeeds, LogRemedy::UseMeasured, motion);
  out.found = least;
  return out;
}

bool in_other_numbers(const Following& f) {
  const double gain = std::abs(f.gain);
  return std::abs(f.correlation) > surely_alike &&
         (f.gain < 0 || gain > most_gain || gain < least_gain || (gain > 0.5 && std::abs(f.offset) > other_zero));
}

/// Commands that joints follow at a constant ratio or distance, as of another unit or zero.
std::optional<LogProblem> scaled_commands(const Motion& motion) {
  const auto others = std::count_if(motion.followings.begin(), motion.followings.end(), in_other_numbers);
  if (2 * others <= static_cast<std::ptrdiff_t>(motion.followings.size())) return std::nullopt;
  LogProblem out = of_commands(LogProblemKind::CommandsScaled, LogRemedy::ScaleCommands, motion);
  out.factors.assign(static_cast<std::size_t>(motion.q.cols()), 1.0);
  out.offsets.assign(static_cast<std::size_t>(motion.q.cols()), 0.0);
  out.found = std::numeric_limits<double>::infinity(), out.found_to = -out.found;
  for (std::size_t m = 0; m < motion.moving.size(); ++m) {
    const Following& f = motion.followings[m];
    if (std::abs(f.correlation) > surely_alike) {
      out.factors[static_cast<std::size_t>(motion.moving[m])] = f.gain;
      out.offsets[static_cast<std::size_t>(motion.moving[m])] = f.offset;
      out.found = std::min(out.found, f.gain), out.found_to = std::max(out.found_to, f.gain);
    }
  }
  const bool degrees = out.found > 0.8 * std::numbers::pi / 180 && out.found_to < 1.2 * std::numbers::pi / 180;
  if (degrees && std::all_of(out.offsets.begin(), out.offsets.end(), [](double o) { return std::abs(o) < other_zero; }))
    out.remedy = LogRemedy::Degrees;
  return out;
}

std::optional<LogProblem> unlike_commands(const Motion& motion) {
  const auto none = std::count_if(motion.followings.begin(), motion.followings.end(),
                                  [](const Following& f) { return std::abs(f.correlation) < hardly_alike; });
  if (2 * none <= static_cast<std::ptrdiff_t>(motion.followings.size())) return std::nullopt;
  LogProblem out = of_commands(LogProblemKind::CommandsUnlike, LogRemedy::UseMeasured, motion);
  for (const Following& f : motion.followings) out.found = std::max(out.found, std::abs(f.correlation));
  return out;
}

/// When a joint that followed its command well stopped doing so, up to the end [s]; nothing where it did not.
std::optional<double> motor_off(const Motion& motion, int joint) {
  const Index n = motion.q.rows(), least = motion.rows_in(shortest_loss);
  const VectorXd off = (motion.q.col(joint) - motion.qc.col(joint)).cwiseAbs();
  Index first = n;
  while (first > 0 && off[first - 1] > lost) --first;
  if (n - first < least || first < fewest_command_rows) return std::nullopt;
  const VectorXd q = motion.q.col(joint).head(first), qc = motion.qc.col(joint).head(first);
  std::vector<double> usual(off.data(), off.data() + first);
  const bool followed =
      span_of(qc) > commanded &&
      best_following(q, qc, std::min(motion.rows_in(longest_lag), first / 4)).correlation > surely_alike &&
      off.tail(n - first).minCoeff() > lost_over_usual * midpoint_median(std::move(usual));
  return followed ? std::optional(motion.t[first]) : std::nullopt;
}

void add_single_joints(const Motion& motion, std::vector<LogProblem>& out) {
  for (const int k : motion.moving) {
    LogProblem problem{.columns = {"q" + std::to_string(k + 1)}, .joint = k, .expected = span_of(motion.qc.col(k))};
    problem.found = span_of(motion.q.col(k));
    if (problem.found < std::min(standing * problem.expected, still)) {
      problem.kind = LogProblemKind::NeverMoves;
      out.push_back(problem);
    } else if (const auto off = motor_off(motion, k)) {
      problem.kind = LogProblemKind::StopsFollowing;
      problem.remedy = LogRemedy::CutLog;
      problem.found = *off;
      out.push_back(problem);
    }
  }
}

}  // namespace

std::vector<LogProblem> check_commands(const cell::Cell& cell, const cell::Experiment& experiment) {
  const std::optional<Motion> motion = commanded_motion(cell, experiment);
  if (!motion || motion->moving.empty()) return {};
  std::vector<LogProblem> out;
  add_single_joints(*motion, out);
  if (!out.empty()) return out;
  for (const auto& check : {equal_commands, speed_commands, scaled_commands, unlike_commands})
    if (const auto problem = check(*motion)) return {*problem};
  return {};
}

}  // namespace kr5::arm_log
