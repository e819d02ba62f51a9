// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/servo_fit.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <kr5/cell/servo_gain.hpp>
#include <kr5/core/error.hpp>
#include <kr5/physics/fold_effects.hpp>
#include <kr5/physics/torque_servo.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "servo_guess.hpp"

namespace kr5::arm_log {

namespace {

constexpr double guessing_time = 10.0;     // of the motion on which first values are found [s]
constexpr double perhaps_different = 1.0;  // standard deviations in a part of the motion, of a law tried on the whole

/// What a fit leaves, over the noise of each column.
double misfit(const gap::JointFit& fit) {
  double out = 0.0;
  for (const gap::ColumnFit& column : fit.columns) out += column.after / std::max(column.noise, 1e-12);
  return out;
}

/// Whether a fit leaves noise alone, about.
bool explains(const gap::JointFit& fit) {
  constexpr double times = 1.5;
  return std::ranges::all_of(fit.columns, [](const gap::ColumnFit& c) { return c.after <= times * c.noise; });
}

/// The cell with the values of a fit as its own.
cell::Cell folded(const gap::JointFit& fit, const cell::Cell& guess) {
  cell::Cell out = physics::fold_effects(fit.cell).cell;
  out.drives->friction.viscous = guess.drives->friction.viscous;
  return out;
}

/// Where the fit of the whole motion begins.
struct Start {
  cell::Cell cell;
  bool explains = false;  ///< Whether it leaves noise alone of its part of the motion.
};

/// The fit of a part of the motion. Lag by a delay and lag by damping are two minima: where a delay was found, the fit
/// begins again with the same lag by damping alone.
Start better_start(const cell::Recording& part, const cell::Simulator& simulator, const cell::Cell& guess,
                   gap::JointFitOptions fitting) {
  fitting.from = guess;
  const gap::JointFit first = gap::fit_joint_effects(part, simulator, fitting);
  const Start found{folded(first, guess), explains(first)};
  if (found.cell.servo->torque_of(0).delay == 0.0) return found;
  fitting.from = found.cell;
  for (cell::TorqueServo& servo : fitting.from->servo->torque) {
    servo.damping += servo.stiffness * servo.delay;
    servo.delay = 0.0;
  }
  const gap::JointFit prompt = gap::fit_joint_effects(part, simulator, fitting);
  return misfit(prompt) < misfit(first) ? Start{folded(prompt, guess), explains(prompt)} : found;
}

/// Whether the motors are off in some rows to fit: there viscous friction acts alone, which elsewhere is as damping is.
bool has_rows_without_motor(const cell::Recording& recording) {
  return std::ranges::any_of(recording.experiments, [](const cell::Experiment& e) {
    const Eigen::VectorXd gain = cell::servo_gain(e.data);
    return e.split == cell::Split::Fit && gain.size() > 0 && gain.minCoeff() == 0.0;
  });
}

bool is_further(const gap::FittedEffect& effect) {
  const std::vector<std::string>& further = physics::further_servo_effects();
  return std::ranges::find(further, effect.effect) != further.end();
}

/// Leaves out further laws that depart from none by no more than some standard deviations. Whether any was left out.
bool leave_out_doubtful(const gap::JointFit& fit, double least, gap::JointFitOptions& fitting) {
  fitting.only.clear();
  fitting.effects.clear();
  for (const gap::FittedEffect& e : fit.effects) {
    if (is_further(e) && !(e.departure > least)) continue;
    fitting.only.push_back(e);
    if (std::ranges::find(fitting.effects, e.effect) == fitting.effects.end()) fitting.effects.push_back(e.effect);
  }
  return fitting.only.size() < fit.effects.size();
}

/// The fit of the whole motion with those of the further laws that act: first those that may act in a part of it.
gap::JointFit fit_with_further_laws(const cell::Recording& recording, const cell::Recording& part,
                                    const cell::Simulator& simulator, gap::JointFitOptions fitting) {
  fitting.coarse = true;
  const std::vector<std::string>& further = physics::further_servo_effects();
  fitting.effects.insert(fitting.effects.end(), further.begin(), further.end());
  leave_out_doubtful(gap::fit_joint_effects(part, simulator, fitting), perhaps_different, fitting);
  gap::JointFit out = gap::fit_joint_effects(recording, simulator, fitting);
  if (leave_out_doubtful(out, surely_different, fitting)) out = gap::fit_joint_effects(recording, simulator, fitting);
  return out;
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
  const Start start = better_start(part, simulator, guess, fitting);
  tell(0.4);
  fitting.from = start.cell;
  const bool coasts = has_rows_without_motor(recording);
  if (coasts) fitting.effects.push_back(physics::coasting_effect());
  std::optional<gap::JointFit> out;
  if (start.explains) out = gap::fit_joint_effects(recording, simulator, fitting);
  tell(0.6);
  if (!out || !explains(*out)) out = fit_with_further_laws(recording, part, simulator, fitting);
  if (!coasts) out->cell.drives->friction.viscous = guess.drives->friction.viscous;  // in place of which is the damping
  tell(1.0);
  return *std::move(out);
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
