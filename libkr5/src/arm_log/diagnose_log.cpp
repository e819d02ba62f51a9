// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/diagnose_log.hpp>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <utility>

#include <kr5/arm_log/model_parts.hpp>
#include <kr5/arm_log/servo_fit.hpp>
#include <kr5/arm_log/torque_constants.hpp>
#include <kr5/cell/known_directions.hpp>
#include <kr5/core/error.hpp>

#include "best_arm_rounds.hpp"
#include "joint_columns.hpp"
#include "servo_diagnosis.hpp"

namespace kr5::arm_log {

namespace {

constexpr int most_rounds = 3;  // of a diagnosis, with the errors of the best arm beside the causes of the one before

void append(std::vector<LogNote>& out, const std::vector<LogNote>& more) {
  out.insert(out.end(), more.begin(), more.end());
}

std::string unknown_constant(const cell::Cell& cell, const TorqueConstants& found, int joint) {
  std::ostringstream out;
  out.precision(3);
  out << "the log does not tell the torque constant of joint " << joint + 1 << " (" << found.values[joint];
  out.precision(2);
  out << " ± " << found.deviations[joint] << " " << load_unit(cell, joint)
      << "/A), which the model does not state; state them in drives.torque_constant of the cell, or log torques";
  return out.str();
}

std::vector<LogNote> add_torque_constants(cell::Recording& recording) {
  const TorqueConstants found = estimate_torque_constants(recording);
  if (found.values.size() == 0) return {};
  if (const int joint = found.first_unknown(); joint >= 0)
    throw InvalidArgument(unknown_constant(recording.cell, found, joint));
  recording.cell.drives->torque_constant = found.values;
  return {{.kind = LogNoteKind::TorqueConstants,
           .values = {found.values.begin(), found.values.end()},
           .deviations = {found.deviations.begin(), found.deviations.end()}}};
}

constexpr double notable_share = 0.01;  // of the rows of a joint

/// The rows of joints that are not compared since the side of dry friction is not known.
std::vector<LogNote> direction_notes(const cell::Recording& recording) {
  const int n = recording.cell.robot.joints();
  Eigen::ArrayXd known = Eigen::ArrayXd::Zero(n);
  double rows = 0.0;
  for (const cell::Experiment& e : recording.experiments) {
    if (e.speed_noise.size() == 0 || load_family(e).empty()) continue;
    known += cell::known_directions(e, n).colwise().sum().transpose();
    rows += static_cast<double>(e.data.values.rows());
  }
  if (rows == 0.0) return {};
  LogNote out{.kind = LogNoteKind::UnknownDirections};
  for (const double of_joint : known) {
    const double share = 1 - of_joint / rows;
    out.values.push_back(share >= notable_share ? share : 0.0);
  }
  return std::ranges::any_of(out.values, [](double share) { return share > 0; }) ? std::vector{out}
                                                                                 : std::vector<LogNote>{};
}

using ExperimentCheck = std::vector<LogProblem> (*)(const cell::Cell&, const cell::Experiment&);

void collect_problems(LogRecording& out, ExperimentCheck check) {
  for (const cell::Experiment& e : out.recording.experiments)
    for (const LogProblem& problem : check(out.recording.cell, e)) out.problems.push_back(problem);
}

void require_plausible(const LogRecording& log) {
  if (log.problems.empty()) return;
  std::string out;
  for (const LogProblem& problem : log.problems) out += text(problem, log.recording.cell) + "\n";
  throw InvalidArgument(out + mismatch_text());
}

bool shows_loads(const cell::Recording& recording) {
  return std::ranges::any_of(recording.experiments, [](const cell::Experiment& e) {
    return e.data.find("tau1") >= 0 || e.data.find("i1") >= 0;
  });
}

/// The diagnosis beside what the best arm leaves.
gap::Diagnosis diagnose_beside(const cell::Recording& recording, const cell::Simulator& simulator,
                               const gap::DiagnoseOptions& options, const BestArmErrors& errors) {
  const gap::DiagnoseOptions wide = widened_search(options, errors, recording.cell.robot.joints());
  const bool of_servos = options.start.empty() && recording.cell.drives && moves_by_torque_servos(recording);
  return of_servos ? diagnose_servos(recording, simulator, wide) : gap::diagnose(recording, simulator, wide);
}

/// The options of a round, which tells its part of the whole: half of what is left.
gap::DiagnoseOptions in_round(const gap::DiagnoseOptions& options, int round) {
  gap::DiagnoseOptions out = options;
  if (!options.progress) return out;
  const double from = 1 - std::pow(0.5, round), share = (1 - from) * (round + 1 < most_rounds ? 0.5 : 1.0);
  out.progress = [tell = options.progress, from, share](const std::string& stage, double part) {
    tell(stage, from + share * part);
  };
  return out;
}

/// The same again where causes that the best arm cannot have, such as a tilt of its base, were its error.
gap::Diagnosis diagnose_in_rounds(const cell::Recording& recording, const cell::Simulator& simulator,
                                  const gap::DiagnoseOptions& options, BestArmErrors& errors) {
  gap::Diagnosis out = diagnose_beside(recording, simulator, in_round(options, 0), errors);
  for (int round = 1; round < most_rounds && !out.causes.empty() && !errors.errors.empty(); ++round) {
    const BestArmErrors left = best_arm_errors(without_causes(recording, simulator, out.cell));
    if (!lessens(errors, left)) break;
    errors.errors = left.errors;
    errors.correlations = left.correlations;
    out = diagnose_beside(recording, simulator, in_round(options, round), errors);
  }
  return out;
}

}  // namespace

std::vector<LogNote> complete_model(cell::Recording& recording, const Readings& readings, bool constants_stated) {
  std::vector<LogNote> out;
  if (!constants_stated && lacks_torque_constants(recording.cell)) append(out, add_torque_constants(recording));
  append(out, add_reading_noise(recording, readings));
  const auto of_joints = [](const LogNote& note) { return note.kind == LogNoteKind::JointNoise; };
  if (std::ranges::any_of(out, of_joints)) append(out, add_noise_colour(recording));
  append(out, direction_notes(recording));
  if (moves_by_torque_servos(recording) && !shows_loads(recording)) out.push_back({.kind = LogNoteKind::TorqueScale});
  return out;
}

LogRecording prepare_log(const ArmLog& log, const cell::Cell& model, const LogDiagnosisOptions& options) {
  cell::Cell cell = model;
  const std::vector<LogNote> added = add_parts_to_try(cell);
  LogRecording out = record_log(log, cell);
  out.notes.insert(out.notes.begin(), added.begin(), added.end());
  collect_problems(out, check_positions);
  if (!options.trust) require_plausible(out);
  append(out.notes, complete_model(out.recording, out.readings, options.constants_stated));
  if (out.problems.empty()) collect_problems(out, check_loads);
  if (!options.trust) require_plausible(out);
  return out;
}

gap::Diagnosis diagnose(const cell::Recording& recording, const cell::Simulator& simulator,
                        const gap::DiagnoseOptions& options) {
  options.validate();
  const bool known = !options.simulator_errors.empty();
  BestArmErrors errors = known ? BestArmErrors{} : best_arm_errors(recording);
  return diagnose_in_rounds(recording, simulator, options, errors);
}

LogDiagnosis diagnose_log(const ArmLog& log, const cell::Cell& model, const LogDiagnosisOptions& options,
                          const cell::Simulator& simulator) {
  options.search.validate();
  LogRecording prepared = prepare_log(log, model, options);
  LogDiagnosis out;
  out.best_arm = best_arm_errors(prepared.recording);
  out.notes = prepared.notes;
  out.problems = prepared.problems;
  append(out.notes, notes_of(out.best_arm, prepared.recording));
  out.diagnosis = diagnose_in_rounds(prepared.recording, simulator, options.search, out.best_arm);
  out.recording = std::move(prepared.recording);
  return out;
}

}  // namespace kr5::arm_log
