// SPDX-License-Identifier: BSD-3-Clause
#include "position_checks.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <kr5/core/statistics.hpp>

#include "command_checks.hpp"
#include "joint_columns.hpp"
#include "tool_checks.hpp"

namespace kr5::arm_log {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double turn = 2 * std::numbers::pi;  // beyond which angles may be degrees [rad]
constexpr double room_share = 0.05;            // of a range, by which readings may leave it
constexpr double min_room = 0.01;              // [rad or m]
constexpr double small_angle = 0.12;           // that no joint leaves, as of radians read as degrees [rad]
constexpr double some_motion = 1e-3;           // [rad or m]
constexpr double most_speed = 3.0;             // times the limit
constexpr double min_speed_share = 3e-3;       // of the limit, of joints that move
constexpr double most_cycles = 50.0;           // between rows

double middle_of(const VectorXd& values) { return median({values.begin(), values.end()}); }

/// The limits of a cell, with room for noise.
class JointRanges {
 public:
  explicit JointRanges(const cell::Cell& cell) : low_(cell.robot.limits->lower), high_(cell.robot.limits->upper) {
    for (Index j = 0; j < low_.size(); ++j) {
      const double range = high_[j] - low_[j], room = room_share * (std::isfinite(range) ? range : 0.0) + min_room;
      low_[j] -= room, high_[j] += room;
    }
  }
  bool hold(const MatrixXd& q) const {
    return (q.colwise().minCoeff().transpose().array() >= low_.array()).all() &&
           (q.colwise().maxCoeff().transpose().array() <= high_.array()).all();
  }

 private:
  VectorXd low_, high_;
};

struct PositionReading {
  LogRemedy remedy;
  VectorXd factor;
};

/// The units and sides in which positions may have been logged.
std::vector<PositionReading> position_readings(const cell::Cell& cell, const MatrixXd& q) {
  const int n = cell.robot.joints();
  VectorXd to_rad(n);
  double largest = 0.0;
  bool turns = false;
  for (int j = 0; j < n; ++j) {
    const bool slide = cell.robot.dh[static_cast<std::size_t>(j)].type == kinematics::JointType::Prismatic;
    to_rad[j] = slide ? 1e-3 : std::numbers::pi / 180;
    if (slide) continue;
    turns = true;
    largest = std::max(largest, q.col(j).cwiseAbs().maxCoeff());
  }
  const VectorXd ratio = cell.drives ? VectorXd(cell.drives->structure.diagonal().cwiseAbs()) : VectorXd::Ones(n);
  std::vector<PositionReading> out = {{LogRemedy::Degrees, to_rad},
                                      {LogRemedy::Radians, to_rad.cwiseInverse()},
                                      {LogRemedy::MotorSide, ratio.cwiseInverse()},
                                      {LogRemedy::DegreesOnMotorSide, to_rad.cwiseQuotient(ratio)}};
  if (turns && largest < turn)  // divided by 57, they would fit any limits
    std::erase_if(out, [](const PositionReading& r) {
      return r.remedy == LogRemedy::Degrees || r.remedy == LogRemedy::DegreesOnMotorSide;
    });
  return out;
}

/// The reading in which positions lie within their ranges; of several the one that follows the commands, where given.
LogRemedy fitting_unit(const cell::Cell& cell, const JointRanges& ranges, const MatrixXd& q, const MatrixXd* commands) {
  LogRemedy out = LogRemedy::Check;
  double nearest = std::numeric_limits<double>::infinity();
  for (const PositionReading& reading : position_readings(cell, q)) {
    const MatrixXd scaled = q * reading.factor.asDiagonal();
    if (!ranges.hold(scaled)) continue;
    const MatrixXd off = commands ? MatrixXd((scaled - *commands).cwiseAbs()) : MatrixXd::Zero(1, 1);
    const double distance = middle_of(off.reshaped());
    if (distance >= nearest) continue;
    nearest = distance;
    out = reading.remedy;
  }
  return out;
}

LogProblem beyond_limits(const cell::Cell& cell, const MatrixXd& q, const std::string& family) {
  const auto& limits = *cell.robot.limits;
  const VectorXd low = q.colwise().minCoeff().transpose(), high = q.colwise().maxCoeff().transpose();
  Index j = 0;
  (high - limits.upper).cwiseMax(limits.lower - low).maxCoeff(&j);
  return {.kind = LogProblemKind::BeyondLimits,
          .columns = {family + std::to_string(j + 1)},
          .joint = static_cast<int>(j),
          .found = low[j],
          .found_to = high[j],
          .expected = limits.lower[j],
          .expected_to = limits.upper[j]};
}

/// Whether positions beside commands are larger than radians that were read as degrees: what is wrong with small
/// commands is then told by how the positions follow them.
bool has_large_positions(const cell::Experiment& experiment, int joints) {
  return has_column(experiment, "q1") && joint_columns(experiment, "q", joints).cwiseAbs().maxCoeff() >= small_angle;
}

bool all_turn(const cell::Robot& robot) {
  return std::all_of(robot.dh.begin(), robot.dh.end(),
                     [](const auto& joint) { return joint.type == kinematics::JointType::Revolute; });
}

std::vector<std::string> family_names(const std::string& family, int joints) {
  std::vector<std::string> out;
  for (int k = 1; k <= joints; ++k) out.push_back(family + std::to_string(k));
  return out;
}

/// Unit of the clock in which its steps make sense.
LogRemedy fitting_time_unit(double step, double cycle) {
  for (const auto& [remedy, scale] : {std::pair{LogRemedy::Milliseconds, 1e-3},
                                      {LogRemedy::Microseconds, 1e-6},
                                      {LogRemedy::Nanoseconds, 1e-9},
                                      {LogRemedy::LongerUnit, 1e3}}) {
    const double seconds = step * scale;
    const bool usual = cycle > 0 ? seconds > cycle / 3 && seconds < 3 * cycle : seconds > 2e-4 && seconds < 0.2;
    if (usual) return remedy;
  }
  return LogRemedy::Check;
}

/// The speed of the fastest joint over its limit, fast rows of noise apart; nothing where no limits are known.
std::optional<double> speed_over_limit(const cell::Cell& cell, const VectorXd& t, const MatrixXd& q) {
  if (!cell.robot.limits || cell.robot.limits->velocity.size() == 0) return std::nullopt;
  const VectorXd& limit = cell.robot.limits->velocity;
  double out = 0.0;
  for (Index j = 0; j < q.cols(); ++j) {
    std::vector<double> speeds;
    for (Index i = 1; i < t.size(); ++i) speeds.push_back(std::abs(q(i, j) - q(i - 1, j)) / (t[i] - t[i - 1]));
    std::sort(speeds.begin(), speeds.end());
    const double at = 0.99 * static_cast<double>(speeds.size() - 1);
    const auto k = std::min(static_cast<std::size_t>(at), speeds.size() - 2);
    out = std::max(out, (speeds[k] + (at - static_cast<double>(k)) * (speeds[k + 1] - speeds[k])) / limit[j]);
  }
  return out;
}

}  // namespace

std::vector<LogProblem> check_limits(const cell::Cell& cell, const cell::Experiment& experiment) {
  const int n = cell.robot.joints();
  if (!cell.robot.limits || cell.robot.limits->lower.size() != n) return {};
  const JointRanges ranges(cell);
  MatrixXd commands;
  if (has_column(experiment, "qc1")) commands = joint_columns(experiment, "qc", n);
  std::vector<LogProblem> out;
  for (const std::string family : {"qc", "q"}) {
    if (!has_column(experiment, family + "1")) continue;
    const MatrixXd q = joint_columns(experiment, family, n);
    // What was measured stands for the motion.
    const std::string name = experiment.joint_reference == cell::JointReference::Measured ? "q" : family;
    if (!ranges.hold(q)) {
      const bool follows = family == "q" && commands.size() > 0 && ranges.hold(commands);
      out.push_back(beyond_limits(cell, q, name));
      out.back().remedy = fitting_unit(cell, ranges, q, follows ? &commands : nullptr);
      continue;
    }
    if (family == "qc" && has_large_positions(experiment, n)) continue;
    const double largest = q.cwiseAbs().maxCoeff();
    const double moved = (q.colwise().maxCoeff() - q.colwise().minCoeff()).maxCoeff();
    if (all_turn(cell.robot) && largest < small_angle && moved > some_motion &&
        ranges.hold(q * (180 / std::numbers::pi)))
      out.push_back({.kind = LogProblemKind::HardlyMoves,
                     .remedy = LogRemedy::Radians,
                     .columns = family_names(name, n),
                     .found = largest});
  }
  return out;
}

std::vector<LogProblem> check_following(const cell::Cell& cell, const cell::Experiment& experiment) {
  constexpr double far = 0.1, near_share = 0.2;  // [rad or m]; of the distance of a joint from its own command
  const int n = cell.robot.joints();
  if (!has_column(experiment, "q1") || !has_column(experiment, "qc1")) return {};
  const MatrixXd q = joint_columns(experiment, "q", n), qc = joint_columns(experiment, "qc", n);
  std::vector<LogProblem> out;
  for (int j = 0; j < n; ++j) {
    VectorXd off(n);
    for (int k = 0; k < n; ++k) off[k] = middle_of((q.col(j) - qc.col(k)).cwiseAbs());
    Index k = 0;
    off.minCoeff(&k);
    if (k == j || !(off[j] > far && off[k] < near_share * off[j])) continue;
    out.push_back({.kind = LogProblemKind::FollowsAnother,
                   .remedy = LogRemedy::Exchange,
                   .columns = {"q" + std::to_string(j + 1)},
                   .joint = j,
                   .other = static_cast<int>(k),
                   .found = off[j]});
  }
  return out;
}

std::vector<LogProblem> check_clock(const cell::Cell& cell, const cell::Experiment& experiment) {
  const int n = cell.robot.joints();
  if (experiment.kind != cell::Kind::Motion || !has_column(experiment, "qc1") || experiment.data.values.rows() < 10)
    return {};
  const VectorXd t = experiment.data.column("t");
  const MatrixXd q = joint_columns(experiment, "qc", n);
  const double step = middle_of(t.tail(t.size() - 1) - t.head(t.size() - 1));
  // Commands to torque servos come at the rate of a log, not of the loop that closes in the servo.
  const double cycle = cell.servo && !cell.has_torque_servos() ? cell.servo->cycle : 0.0;
  LogProblem out{.remedy = fitting_time_unit(step, cycle), .columns = {"t"}, .expected = cycle};
  const std::optional<double> speed = speed_over_limit(cell, t, q);
  const double moved = (q.colwise().maxCoeff() - q.colwise().minCoeff()).maxCoeff();
  if (speed && (*speed > most_speed || (*speed < min_speed_share && moved > 0.05))) {
    out.kind = LogProblemKind::SpeedBeyond;
    out.found = *speed;
    return {out};
  }
  if (!(cycle > 0) || (step <= most_cycles * cycle && step >= cycle / most_cycles)) return {};
  out.kind = LogProblemKind::RowsApart;
  out.found = step;
  return {out};
}

std::vector<LogProblem> check_positions(const cell::Cell& cell, const cell::Experiment& experiment) {
  std::vector<LogProblem> out;
  for (const auto& check : {check_limits, check_following, check_clock, check_tool})
    for (LogProblem& problem : check(cell, experiment)) {
      problem.experiment = experiment.name;
      out.push_back(problem);
    }
  if (!out.empty()) return out;  // commands are compared once positions are in their unit and order
  for (LogProblem& problem : check_commands(cell, experiment)) {
    problem.experiment = experiment.name;
    out.push_back(problem);
  }
  return out;
}

}  // namespace kr5::arm_log
