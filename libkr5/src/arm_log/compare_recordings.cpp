// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/compare_recordings.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include <kr5/arm_log/best_arm.hpp>
#include <kr5/arm_log/diagnose_log.hpp>
#include <kr5/core/error.hpp>
#include <kr5/gap/measure.hpp>
#include <kr5/physics/fold_effects.hpp>

#include "best_arm_rounds.hpp"
#include "effect_change.hpp"
#include "joint_columns.hpp"
#include "reference_arm.hpp"

namespace kr5::arm_log {

namespace {

constexpr int parts = 4;              // diagnoses of a comparison, at most
constexpr double unmeasured = 100.0;  // times what a load is, as the error of one that says nothing

/// The options of one of these diagnoses, which tells its part of the whole.
gap::DiagnoseOptions in_part(const gap::DiagnoseOptions& options, int part, const std::string& name) {
  gap::DiagnoseOptions out = options;
  if (options.progress)
    out.progress = [tell = options.progress, part, name](const std::string& stage, double fraction) {
      tell(name + ": " + stage, (part + fraction) / parts);
    };
  return out;
}

std::string families_of(const cell::Recording& recording) {
  for (const cell::Experiment& e : recording.experiments)
    if (on_measured_positions(e)) return load_family(e) == "i" ? "currents" : "torques";
  return "";
}

void require_comparable(const cell::Recording& first, const cell::Recording& second) {
  const int a = first.cell.robot.joints(), b = second.cell.robot.joints();
  require(a == b, "the recordings are of different robots: the first has " + std::to_string(a) +
                      " joints, the second has " + std::to_string(b));
  for (int k = 0; k < a; ++k)
    require(
        first.cell.robot.dh[static_cast<std::size_t>(k)].type == second.cell.robot.dh[static_cast<std::size_t>(k)].type,
        "the recordings are of different robots: joint " + std::to_string(k + 1) +
            " turns in one of them and slides in the other");
  const std::string of_first = families_of(first), of_second = families_of(second);
  require(of_first.empty() || of_second.empty() || of_first == of_second,
          "the first recording holds " + of_first + " of the joints and the second " + of_second +
              "; expected the same quantity in both");
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

std::string column_of(cell::Kind kind, const std::string& column) {
  return std::string(kr5::name_of(kind)) + "." + column;
}

/// RMS beyond noise of what a cell leaves of its own recording, in columns of which no error is known.
std::vector<gap::ColumnError> errors_left(const cell::Recording& recording, const cell::Cell& cell,
                                          const cell::Simulator& simulator,
                                          const std::vector<gap::ColumnError>& known) {
  std::map<std::string, std::pair<double, double>> sums;  // of squares, and rows
  for (const gap::ColumnGap& c : gap::measure(recording, cell, simulator).columns) {
    const std::string column = column_of(c.kind, c.column);
    if (std::ranges::find(known, column, &gap::ColumnError::column) != known.end()) continue;
    const double beyond = c.exceeds ? c.noise * c.noise * (c.gap * c.gap - 1) : 0.0;
    sums[column].first += c.rows * beyond;
    sums[column].second += c.rows;
  }
  std::vector<gap::ColumnError> out;
  for (const auto& [column, sum] : sums)
    if (sum.first > 0) out.push_back({column, std::sqrt(sum.first / sum.second)});
  return out;
}

/// Loads that the other recording did not measure either say nothing, and its noise may be alike in neighbouring rows.
void add_errors_of(const cell::Recording& other, BestArmErrors& errors) {
  const BestArmErrors own = best_arm_errors(other);
  for (const gap::ColumnError& one : own.errors) {
    const int joint = std::stoi(one.column.substr(one.column.find_first_of("0123456789"))) - 1;
    if (std::ranges::find(own.unmeasured, joint) != own.unmeasured.end()) add_errors(errors.errors, {one});
  }
  for (const gap::ColumnCorrelation& one : own.correlations) {
    const auto same = std::ranges::find(errors.correlations, one.column, &gap::ColumnCorrelation::column);
    if (same == errors.correlations.end())
      errors.correlations.push_back(one);
    else
      same->correlation = std::max(same->correlation, one.correlation);
  }
}

/// Of columns alone that a recording compares, with errors that are finite.
void keep_compared(const cell::Recording& recording, const cell::Simulator& simulator, BestArmErrors& errors) {
  std::map<std::string, double> size;
  for (const gap::ColumnGap& c : gap::measure(recording, simulator).columns)
    size[column_of(c.kind, c.column)] = std::max(c.rms, c.noise);
  std::erase_if(errors.errors, [&](const gap::ColumnError& one) { return !size.contains(one.column); });
  std::erase_if(errors.correlations, [&](const gap::ColumnCorrelation& one) { return !size.contains(one.column); });
  for (gap::ColumnError& one : errors.errors)
    if (!std::isfinite(one.error)) one.error = unmeasured * size[one.column];
}

/// A recording with its diagnosis, as the reference of another.
struct Reference {
  const cell::Recording& recording;
  const gap::Diagnosis& diagnosis;
  cell::Cell tuned;  ///< What can be folded into the model can change again: the search adds no effect twice.
};

Reference reference_of(const cell::Recording& recording, const gap::Diagnosis& diagnosis) {
  return {recording, diagnosis, physics::fold_effects(diagnosis.cell).cell};
}

/// What differs in a recording from the reference.
struct Difference {
  gap::Diagnosis diagnosis;
  std::vector<EffectChange> changes;
  bool by_arm = false;
};

Difference difference_from(const Reference& of, const cell::Recording& other, const cell::Simulator& simulator,
                           const gap::DiagnoseOptions& options) {
  cell::Recording reference = of.recording, compared = other;
  reference.cell = compared.cell = of.tuned;
  compared.cell.noise = other.cell.noise;
  if (std::ranges::all_of(other.experiments, on_measured_positions)) {
    // Effects that no arm of rigid links has, and both recordings have, are in neither.
    reference.cell.effects = compared.cell.effects = {};
    reference = without_causes(reference, simulator, of.tuned);
    compared = without_causes(compared, simulator, of.tuned);
  }
  Difference out;
  BestArmErrors errors;
  const std::optional<ReferenceArm> arm = reference_arm(reference);
  out.by_arm = arm.has_value();
  if (arm) {
    errors = best_arm_errors(reference);
    add_errors_of(compared, errors);
    Relative relative = relative_to(*arm, compared, simulator);
    compared = std::move(relative.recording);
    add_errors(errors.errors, relative.errors);
  }
  add_errors(errors.errors, errors_left(reference, reference.cell, simulator, errors.errors));
  keep_compared(compared, simulator, errors);
  out.diagnosis = gap::diagnose(compared, simulator, widened_search(options, errors, of.tuned.robot.joints()));
  out.changes =
      changes_of(out.diagnosis, of.diagnosis, of.tuned, deviations_by(arm, compared, simulator, out.diagnosis.causes));
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

}  // namespace

RecordingComparison compare_recordings(const cell::Recording& first, const cell::Recording& second,
                                       const cell::Simulator& simulator, const gap::DiagnoseOptions& options) {
  options.validate();
  require_comparable(first, second);
  RecordingComparison out;
  out.first = arm_log::diagnose(first, simulator, in_part(options, 0, "first recording"));
  const Reference of_first = reference_of(first, out.first);
  out.gap_with_model = gap::measure(second, first.cell, simulator).gap;
  out.gap_with_first = gap::measure(second, of_first.tuned, simulator).gap;
  Difference found = difference_from(of_first, second, simulator, in_part(options, 1, "difference"));
  // A load that was taken off is one effect from the other side.
  if (!is_settled(found.diagnosis) || found.changes.size() > 1) {
    const gap::Diagnosis of_second = arm_log::diagnose(second, simulator, in_part(options, 2, "second recording"));
    Difference back =
        difference_from(reference_of(second, of_second), first, simulator, in_part(options, 3, "difference, reversed"));
    out.reversed = is_better(back, found);
    if (out.reversed) {
      found = std::move(back);
      reverse(found.changes);
    }
  }
  for (const gap::Cause& cause : out.first.causes)
    if (std::ranges::find(found.changes, gap::EffectName(cause)) == found.changes.end()) out.common.push_back(cause);
  out.by_arm = found.by_arm;
  out.difference = std::move(found.diagnosis);
  out.changes = std::move(found.changes);
  if (options.progress) options.progress("difference", 1.0);
  return out;
}

}  // namespace kr5::arm_log
