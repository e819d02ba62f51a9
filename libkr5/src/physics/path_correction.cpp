// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/path_correction.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include <kr5/core/error.hpp>
#include <kr5/physics/second_order.hpp>
#include <kr5/physics/servo.hpp>

namespace kr5::physics {
namespace {

double limit(const std::optional<double>& most) { return most.value_or(std::numeric_limits<double>::infinity()); }

void require_positive(double value, const std::string& field) {
  require(value > 0.0, field + " is not positive: found " + std::to_string(value));
}

}  // namespace

PathServo::PathServo(const cell::Cell& cell) {
  require(cell.servo && cell.servo->tool, "servo.tool: this cell has no path correction");
  servo = path_servo(cell);
  cycle = cell.servo->cycle;
  correction = cell.servo->correction.value_or(cell::Correction{});
  require_positive(servo.natural_frequency, "servo.tool.natural_frequency");
  require_positive(cycle, "servo.cycle");
  require_positive(limit(correction.per_cycle), "servo.correction.per_cycle");
  require_positive(limit(correction.total), "servo.correction.total");
}

PathCommand::PathCommand(const PathServo& servo, double start)
    : correction_(servo.correction),
      start_(start),
      last_(start),
      line_(static_cast<std::size_t>(std::max(std::lround(servo.servo.delay / servo.cycle), 0L)), start) {}

double PathCommand::next(double asked, double z) {
  const bool absolute = correction_.mode == cell::CorrectionMode::Absolute;
  const double from = absolute ? last_ : z, wanted = absolute ? asked : z + asked;
  const double step = limit(correction_.per_cycle), range = limit(correction_.total);
  last_ = std::clamp(std::clamp(wanted, from - step, from + step), start_ - range, start_ + range);
  limited_ = last_ != wanted;
  if (line_.empty()) return last_;
  const double due = std::exchange(line_[at_], last_);
  at_ = (at_ + 1) % line_.size();
  return due;
}

PathCorrectionState PathCommand::state() const {
  PathCorrectionState out{.start = start_, .last = last_, .line = line_, .limited = limited_};
  std::rotate(out.line.begin(), out.line.begin() + static_cast<std::ptrdiff_t>(at_), out.line.end());
  return out;
}

void PathCommand::restore(const PathCorrectionState& state) {
  require(state.line.size() == line_.size(), "line: found " + std::to_string(state.line.size()) +
                                                 " commands, expected " + std::to_string(line_.size()) +
                                                 ", the cycles of the delay");
  start_ = state.start;
  last_ = state.last;
  line_ = state.line;
  at_ = 0;
  limited_ = state.limited;
}

PathCorrection::PathCorrection(const PathServo& servo, double start)
    : command_(servo, start), decay_(transition(servo.servo, servo.cycle)), state_(start, 0.0) {}

void PathCorrection::advance(double asked) {
  const Eigen::Vector2d held(command_.next(asked, z()), 0.0);
  state_ = held + decay_ * (state_ - held);
}

PathCorrectionState PathCorrection::state() const {
  PathCorrectionState out = command_.state();
  out.servo = state_;
  return out;
}

void PathCorrection::restore(const PathCorrectionState& state) {
  command_.restore(state);
  state_ = state.servo;
}

}  // namespace kr5::physics
