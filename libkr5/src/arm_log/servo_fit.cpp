// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/servo_fit.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <kr5/core/error.hpp>
#include <kr5/physics/fold_effects.hpp>
#include <kr5/physics/torque_servo.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "servo_guess.hpp"

namespace kr5::arm_log {

namespace {

constexpr double guessing_time = 10.0;  // of the motion on which first values are found [s]

/// What a fit leaves, over the noise of each column.
double misfit(const gap::JointFit& fit) {
  double out = 0.0;
  for (const gap::ColumnFit& column : fit.columns) out += column.after / std::max(column.noise, 1e-12);
  return out;
}

/// The cell with the values of a fit as its own.
cell::Cell folded(const gap::JointFit& fit, const cell::Cell& guess) {
  cell::Cell out = physics::fold_effects(fit.cell).cell;
  out.drives->friction.viscous = guess.drives->friction.viscous;
  return out;
}

/// The fit of a part of the motion. Lag by a delay and lag by damping are two minima: where a delay was found, the fit
/// begins again with the same lag by damping alone.
cell::Cell better_start(const cell::Recording& part, const cell::Simulator& simulator, const cell::Cell& guess,
                        gap::JointFitOptions fitting) {
  fitting.from = guess;
  const gap::JointFit first = gap::fit_joint_effects(part, simulator, fitting);
  const cell::Cell found = folded(first, guess);
  if (found.servo->torque_of(0).delay == 0.0) return found;
  fitting.from = found;
  for (cell::TorqueServo& servo : fitting.from->servo->torque) {
    servo.damping += servo.stiffness * servo.delay;
    servo.delay = 0.0;
  }
  const gap::JointFit prompt = gap::fit_joint_effects(part, simulator, fitting);
  return misfit(prompt) < misfit(first) ? folded(prompt, guess) : found;
}

/// Guess and fit on the part of the motion that tells most, then the fit of everything.
gap::JointFit fit_servos(const cell::Recording& recording, const cell::Simulator& simulator,
                         const ServoFitOptions& options) {
  const auto tell = [&](double fraction) {
    if (options.progress) options.progress(fraction);
  };
  gap::JointFitOptions fitting{.effects = servo_effects(), .threads = options.threads, .progress = {}};
  const cell::Recording part = moving_part(recording, guessing_time);
  const cell::Cell guess =
      guess_servos(part, simulator, options.threads, [&](double fraction) { tell(0.3 * fraction); });
  const cell::Cell from = better_start(part, simulator, guess, fitting);
  tell(0.5);
  fitting.from = from;
  gap::JointFit out = gap::fit_joint_effects(recording, simulator, fitting);
  out.cell.drives->friction.viscous = guess.drives->friction.viscous;  // what the damping of servos took the place of
  tell(1.0);
  return out;
}

}  // namespace

const std::vector<std::string>& servo_effects() { return physics::servo_motion_effects(); }

bool moves_by_torque_servos(const cell::Recording& recording) {
  return recording.cell.has_torque_servos() &&
         std::ranges::any_of(recording.experiments, [](const cell::Experiment& e) {
           return e.kind == cell::Kind::Motion && e.split == cell::Split::Fit &&
                  e.joint_reference == cell::JointReference::Commanded && e.data.find("q1") >= 0;
         });
}

void ServoFitOptions::validate() const { require(threads >= 0, "threads must not be negative"); }

gap::JointFit identify_servos(const cell::Recording& recording, const ServoFitOptions& options) {
  options.validate();
  require(recording.cell.has_torque_servos(),
          "servo.torque: the model states no torque servos; state a first guess of their stiffness and damping");
  require(moves_by_torque_servos(recording),
          "found no motion to fit with commands (qc1 ...) and measured positions (q1 ...) beside them; log both");
  require(recording.cell.drives.has_value(), "drives: the model states none, whose friction and rotors are estimated");
  return fit_servos(recording, predict::FastSimulator(), options);
}

ServoFit identify_servos(const ArmLog& log, const cell::Cell& model, const ServoFitOptions& options) {
  options.validate();
  require(log.command.size() > 0,
          "command: found no commands, by which the servos make the motion; log them, or name their columns");
  require(log.q.size() > 0, "q: found no measured positions, by which the servos are judged; log them");
  LogRecording prepared = prepare_log(log, model, {.search = {}, .trust = options.trust});
  ServoFit out;
  out.fit = identify_servos(prepared.recording, options);
  out.recording = std::move(prepared.recording);
  out.notes = std::move(prepared.notes);
  out.problems = std::move(prepared.problems);
  return out;
}

}  // namespace kr5::arm_log
