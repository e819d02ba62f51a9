// SPDX-License-Identifier: BSD-3-Clause
#include "servo_diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <ranges>
#include <string>
#include <vector>

#include <kr5/arm_log/servo_fit.hpp>
#include <kr5/physics/torque_servo.hpp>

namespace kr5::arm_log {

namespace {

/// Parts of the time that the fit and the diagnoses before the last take, about.
constexpr double fit_part = 0.2, nominal_part = 0.4, first_part = 0.7;
/// Times the noise, beyond which servos do not explain a motion.
constexpr double beyond_servos = 1.5;
/// Part of a gap that they leave then, above which something else may have bent them.
constexpr double left_by_servos = 0.1;
/// Of the noise, that a fit may leave by chance.
constexpr double by_chance = 0.1;

/// A listener to one part of the whole.
std::function<void(const std::string&, double)> part_of(const gap::DiagnoseOptions& options, double from, double to) {
  if (!options.progress) return {};
  return [listener = options.progress, from, to](const std::string& stage, double fraction) {
    listener(stage, from + (to - from) * fraction);
  };
}

gap::JointFit fitted_servos(const cell::Recording& recording, const gap::DiagnoseOptions& options) {
  ServoFitOptions fitting{.threads = options.threads, .progress = {}};
  if (const auto tell = part_of(options, 0.0, fit_part))
    fitting.progress = [tell](double fraction) { tell("fitting the servos", fraction); };
  return identify_servos(recording, fitting);
}

/// Whether so much is left that something else may be wrong, to which the servos were bent.
bool may_be_bent(const gap::JointFit& fit) {
  double before = 0.0, after = 0.0;
  bool beyond = false;
  for (const gap::ColumnFit& c : fit.columns) {
    before += std::pow(c.before / c.noise, 2);
    after += std::pow(c.after / c.noise, 2);
    beyond = beyond || std::max(c.after, c.check_after) > beyond_servos * c.noise;
  }
  return beyond && std::sqrt(after) > left_by_servos * std::sqrt(before);
}

bool has_answer(const gap::Diagnosis& found) {
  return found.verdict == gap::Verdict::NoGap || found.verdict == gap::Verdict::Explained;
}

/// What a fit leaves beyond noise, beside the errors that are known already.
std::vector<gap::ColumnError> errors_of(const gap::JointFit& fit, std::vector<gap::ColumnError> known) {
  for (const gap::ColumnFit& column : fit.columns) {
    const double off = std::max(column.after, column.check_after), noise = column.noise;
    const double beyond = std::sqrt(std::max(off * off - noise * noise, by_chance * by_chance * noise * noise));
    if (std::ranges::none_of(known, [&](const gap::ColumnError& e) { return e.column == column.column; }))
      known.push_back({column.column, beyond});
  }
  return known;
}

/// Effects that differ from the model beyond doubt.
std::vector<gap::FittedEffect> sure_effects(const gap::JointFit& fit) {
  std::vector<gap::FittedEffect> out;
  for (const gap::FittedEffect& e : fit.effects)
    if (e.departure > surely_different) out.push_back(e);
  return out;
}

/// Whether the servos of the model are of the scale of those of the log in most joints, so that slopes at the model
/// lead to them. A single joint of several may be bent by what its servo is not.
bool of_the_scale(const cell::Cell& model, const gap::JointFit& fit) {
  constexpr double times = 3.0;
  const int joints = model.robot.joints();
  int others = 0;
  for (int j = 0; j < joints; ++j) {
    const double ratio = physics::servo_stiffness(fit.cell, j) / std::max(physics::servo_stiffness(model, j), 1e-12);
    if (ratio > times || ratio < 1.0 / times) ++others;
  }
  return others < std::max((joints + 1) / 2, std::min(joints, 2));
}

/// Whether what servos leave is so little that further effects may explain it to the noise.
bool nearly_explains(const gap::JointFit& fit) {
  constexpr double times = 10.0;
  return std::ranges::all_of(fit.columns, [](const gap::ColumnFit& c) { return c.after < times * c.noise; });
}

}  // namespace

gap::Diagnosis diagnose_servos(const cell::Recording& recording, const cell::Simulator& simulator,
                               const gap::DiagnoseOptions& options) {
  const gap::JointFit fit = fitted_servos(recording, options);
  gap::DiagnoseOptions search = options;
  const bool real = !nearly_explains(fit) && !of_the_scale(recording.cell, fit);
  if (!real && may_be_bent(fit)) {
    search.progress = part_of(options, fit_part, nominal_part);
    gap::Diagnosis out = gap::diagnose(recording, simulator, search);
    if (has_answer(out)) return out;
  }
  const bool errors_stated = !options.simulator_errors.empty() && !options.errors_of_recording;
  if (!real) {
    search.start = fit.effects;
    search.progress = part_of(options, nominal_part, first_part);
    gap::Diagnosis out = gap::diagnose(recording, simulator, search);
    if (has_answer(out) || errors_stated) return out;
  }
  search.start = sure_effects(fit);
  if (!errors_stated) search.simulator_errors = errors_of(fit, options.simulator_errors);
  search.errors_of_recording = true;
  search.progress = part_of(options, first_part, 1.0);
  return gap::diagnose_start(recording, simulator, search);
}

}  // namespace kr5::arm_log
