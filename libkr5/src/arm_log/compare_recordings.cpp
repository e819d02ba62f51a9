// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/compare_recordings.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <kr5/arm_log/best_arm.hpp>
#include <kr5/arm_log/diagnose_log.hpp>
#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/gap/measure.hpp>
#include <kr5/physics/fold_effects.hpp>

#include "reference_arm.hpp"

namespace kr5::arm_log {

namespace {

/// The options of one of three diagnoses, which tells its part of the whole.
gap::DiagnoseOptions in_part(const gap::DiagnoseOptions& options, int part, const std::string& name) {
  gap::DiagnoseOptions out = options;
  if (options.progress)
    out.progress = [tell = options.progress, part, name](const std::string& stage, double fraction) {
      tell(name + ": " + stage, (part + fraction) / 3.0);
    };
  return out;
}

void require_same_robot(const cell::Recording& first, const cell::Recording& second) {
  const int a = first.cell.robot.joints(), b = second.cell.robot.joints();
  require(a == b, "the recordings are of different robots: the first has " + std::to_string(a) +
                      " joints, the second has " + std::to_string(b));
}

/// Adds errors of columns to those of other reasons.
void add_errors(std::vector<gap::ColumnError>& out, const std::vector<gap::ColumnError>& more) {
  for (const gap::ColumnError& one : more) {
    const auto same = std::ranges::find(out, one.column, &gap::ColumnError::column);
    if (same == out.end())
      out.push_back(one);
    else
      same->error = std::hypot(same->error, one.error);
  }
}

/// What a cell leaves of its own recording beyond noise, in columns of which no error is known.
std::vector<gap::ColumnError> errors_left(const cell::Recording& recording, const cell::Cell& cell,
                                          const cell::Simulator& simulator,
                                          const std::vector<gap::ColumnError>& known) {
  std::vector<gap::ColumnError> out;
  for (const gap::ColumnGap& c : gap::measure(recording, cell, simulator).columns) {
    const std::string column = std::string(kr5::name_of(c.kind)) + "." + c.column;
    if (!c.exceeds || std::ranges::find(known, column, &gap::ColumnError::column) != known.end()) continue;
    add_errors(out, {{column, c.noise * std::sqrt(c.gap * c.gap - 1)}});
  }
  return out;
}

/// What differs in `other` from a recording to whose diagnosis the cell was tuned.
struct Difference {
  gap::Diagnosis diagnosis;
  std::vector<EffectChange> changes;
};

/// Whether a cell carries an effect beside its nominal parameters.
bool is_active(const cell::Cell& cell, const gap::EffectName& name) {
  return std::ranges::any_of(cell::active_effects(cell.effects), [&](const cell::ActiveEffect& active) {
    return active.id == name.effect && active.target == name.target;
  });
}

/// Numbers of a parameter as a cell has it: set as an effect, or as the model states it. Of an effect that is not there
/// its first parameter is 0, and the others have no value: a payload without mass has no centre of mass.
std::vector<double> stated(const cell::Cell& cell, const gap::EffectName& effect, const gap::ParameterEstimate& p) {
  const auto value = is_active(cell, effect) ? cell::get_effect(cell.effects, effect.effect, effect.target, p.name)
                                             : cell::nominal_value(cell, effect.effect, effect.target, p.name);
  if (!value) return std::vector<double>(cell::find_effect(effect.effect).parameters.front().name == p.name, 0.0);
  if (const auto* number = std::get_if<double>(&*value)) return {*number};
  if (const auto* vector = std::get_if<Eigen::VectorXd>(&*value)) return {vector->begin(), vector->end()};
  return {};
}

/// @param own Standard deviations that the reference adds to the parameters of all causes, one after the other.
std::vector<EffectChange> changes_of(const gap::Diagnosis& found, const cell::Cell& tuned, const Eigen::VectorXd& own) {
  std::vector<EffectChange> out;
  Eigen::Index at = 0;
  for (const gap::Cause& cause : found.causes) {
    EffectChange change{{cause.effect, cause.target}, cause.probability, cause.explained_fraction, {}, cause.tied_with};
    for (const gap::ParameterEstimate& p : cause.parameters) {
      ParameterChange& one =
          change.parameters.emplace_back(ParameterChange{p.name, stated(tuned, cause, p), p.value, p.std, p.unit});
      for (double& std : one.std) std = std::hypot(std, own[at++]);
    }
    out.push_back(std::move(change));
  }
  return out;
}

Difference difference_from(const cell::Recording& recording, const cell::Cell& tuned, const cell::Recording& other,
                           const cell::Simulator& simulator, const gap::DiagnoseOptions& options) {
  cell::Recording reference = recording, compared = other;
  reference.cell = tuned;
  compared.cell = tuned;
  compared.cell.noise = other.cell.noise;
  BestArmErrors errors;
  const std::optional<ReferenceArm> arm = reference_arm(reference);
  if (arm) {
    errors = best_arm_errors(reference);
    Relative relative = relative_to(*arm, compared, simulator);
    compared = std::move(relative.recording);
    add_errors(errors.errors, relative.errors);
  }
  add_errors(errors.errors, errors_left(recording, tuned, simulator, errors.errors));
  Difference out;
  out.diagnosis = gap::diagnose(compared, simulator, widened_search(options, errors, tuned.robot.joints()));
  out.changes = changes_of(out.diagnosis, tuned, deviations_by(arm, compared, simulator, out.diagnosis.causes));
  return out;
}

/// Whether causes were found and leave nothing, or there is nothing to find.
bool is_settled(const gap::Diagnosis& found) {
  return found.verdict == gap::Verdict::NoGap || found.verdict == gap::Verdict::Explained;
}

/// Whether one difference is told better than another: it leaves nothing and the other does, or it takes fewer effects.
bool is_better(const Difference& a, const Difference& b) {
  if (is_settled(a.diagnosis) != is_settled(b.diagnosis)) return is_settled(a.diagnosis);
  return is_settled(a.diagnosis) && a.changes.size() < b.changes.size();
}

/// The same change, seen from the other recording.
void reverse(std::vector<EffectChange>& changes) {
  for (EffectChange& change : changes)
    for (ParameterChange& p : change.parameters) std::swap(p.first, p.second);
}

}  // namespace

RecordingComparison compare_recordings(const cell::Recording& first, const cell::Recording& second,
                                       const cell::Simulator& simulator, const gap::DiagnoseOptions& options) {
  options.validate();
  require_same_robot(first, second);
  RecordingComparison out;
  out.first = arm_log::diagnose(first, simulator, in_part(options, 0, "first recording"));
  // What is folded into the model can change again: the search adds no effect twice.
  const cell::Cell tuned = physics::fold_effects(out.first.cell).cell;
  out.gap_with_model = gap::measure(second, first.cell, simulator).gap;
  out.gap_with_first = gap::measure(second, tuned, simulator).gap;
  Difference found = difference_from(first, tuned, second, simulator, in_part(options, 1, "difference"));
  if (!is_settled(found.diagnosis) ||
      found.changes.size() > 1) {  // a load that was taken off is one from the other side
    const gap::DiagnoseOptions last = in_part(options, 2, "difference, reversed");
    const cell::Cell other = physics::fold_effects(arm_log::diagnose(second, simulator, last).cell).cell;
    Difference back = difference_from(second, other, first, simulator, last);
    out.reversed = is_better(back, found);
    if (out.reversed) {
      found = std::move(back);
      reverse(found.changes);
    }
  }
  for (const gap::Cause& cause : out.first.causes)
    if (std::ranges::find(found.changes, gap::EffectName(cause)) == found.changes.end()) out.common.push_back(cause);
  out.difference = std::move(found.diagnosis);
  out.changes = std::move(found.changes);
  return out;
}

}  // namespace kr5::arm_log
