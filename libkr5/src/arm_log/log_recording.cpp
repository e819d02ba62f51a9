// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/log_recording.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <kr5/arm_log/measured_positions.hpp>
#include <kr5/arm_log/motion_split.hpp>
#include <kr5/cell/servo_gain.hpp>
#include <kr5/core/error.hpp>
#include <kr5/physics/effective_arm.hpp>
#include <kr5/physics/effective_drives.hpp>

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::size_t fewest_kept_rows = 10;  // of an experiment once its ends are left out

/// A log whose times count from its beginning, with one family of loads, and what stands for its motion.
struct MotionLog {
  VectorXd t, servo_gain;
  MatrixXd q, command, loads;
  std::string family;  // of the loads: tau or i; empty where none were logged
  bool commanded = false;
};

MotionLog motion_log(const ArmLog& log, const cell::Cell& cell) {
  MotionLog out;
  out.t = log.t.array() - log.t[0];
  out.commanded = log.command.size() > 0 && cell.servo && (!cell.servo->joint.empty() || cell.has_torque_servos());
  out.q = log.q.size() > 0 ? log.q : log.command;
  if (out.commanded) out.command = log.command;
  if (out.commanded && cell.has_torque_servos()) out.servo_gain = log.servo_gain;
  out.family = log.effort.size() > 0 ? "tau" : log.current.size() > 0 ? "i" : "";
  out.loads = log.effort.size() > 0 ? log.effort : log.current;
  return out;
}

/// Time constants after which a servo has forgotten how it began.
constexpr double settled = 8.0;
constexpr double longest_settling = 2.0;  // of a torque servo, whose damping a model may not state [s]

/// The same of a torque servo that moves an inertia: the slower of its creep and the decay of its oscillation [s].
double settle_time(const cell::TorqueServo& servo, double inertia) {
  const double creep = servo.damping / std::max(servo.stiffness, 1e-9);
  const double decay = 2 * inertia / std::max(servo.damping, 1e-9);
  return std::min(settled * std::max(creep, decay), longest_settling) + servo.delay;
}

/// A table of a motion: columns by family, rows x joints.
io::Table motion_table(const VectorXd& t, const std::vector<std::pair<std::string, MatrixXd>>& families, int joints,
                       const VectorXd& servo_gain = {}) {
  io::Table out;
  out.values.resize(t.size(),
                    1 + joints * static_cast<Index>(families.size()) + static_cast<Index>(servo_gain.size() > 0));
  Index at = 0;
  for (const cell::Column& column : cell::columns(cell::Kind::Motion, joints)) {
    if (column.name == "t") {
      out.columns.push_back("t");
      out.values.col(at++) = t;
    }
    if (column.name == cell::servo_gain_column && servo_gain.size() > 0) {
      out.columns.push_back(column.name);
      out.values.col(at++) = servo_gain;
    }
    for (const auto& [family, values] : families)
      for (int k = 0; k < joints; ++k) {
        if (column.name != family + std::to_string(k + 1)) continue;
        out.columns.push_back(column.name);
        out.values.col(at++) = values.col(k);
      }
  }
  return out;
}

cell::Experiment motion_experiment(const MotionSpan& span, std::size_t number) {
  cell::Experiment out;
  out.name = "motion-" + std::to_string(number);
  out.file = out.name + ".csv";
  out.split = span.split;
  return out;
}

/// Rows of a log that the filter of a span may use: those near it, without a gap.
physics::RowRange filtered_rows(const VectorXd& t, const MotionSpan& span) {
  const auto first = std::lower_bound(t.begin(), t.end(), span.begin - smoothing_margin) - t.begin();
  const auto last = std::lower_bound(t.begin(), t.end(), span.end + smoothing_margin) - t.begin();
  physics::RowRange out{last, first};
  for (const physics::RowRange& part : parts_without_gap(t.segment(first, last - first))) {
    if (t[first + part.last - 1] < span.begin || t[first + part.first] >= span.end) continue;
    out.first = std::min(out.first, first + part.first);
    out.last = std::max(out.last, first + part.last);
  }
  require(out.size() > 0, "t: found no row of an experiment");
  return out;
}

class MeasuredMotions {
 public:
  MeasuredMotions(const MotionLog& log, int joints, const std::vector<MotionSpan>& spans) : log_(log), joints_(joints) {
    for (const MotionSpan& span : spans) {
      const physics::RowRange rows = filtered_rows(log.t, span);
      const Smoothing found =
          choose_smoothing(log.t.segment(rows.first, rows.size()), log.q.middleRows(rows.first, rows.size()),
                           log.loads.middleRows(rows.first, rows.size()));
      const VectorXd before = smoothing_.speed_noise;
      if (found.cutoff > smoothing_.cutoff) smoothing_ = found;  // all parts of a log are smoothed alike
      if (before.size() > 0) smoothing_.speed_noise = before.cwiseMax(found.speed_noise);
    }
  }

  const Smoothing& smoothing() const { return smoothing_; }

  cell::Experiment experiment(const MotionSpan& span, std::size_t number, Readings& readings) const {
    const physics::RowRange rows = filtered_rows(log_.t, span);
    VectorXd t = log_.t.segment(rows.first, rows.size());
    if (smoothing_.even_step > 0)
      for (Index i = 0; i < t.size(); ++i) t[i] = t[0] + static_cast<double>(i) * smoothing_.even_step;
    const MatrixXd loads = log_.loads.middleRows(rows.first, rows.size());
    const Positions smooth = smooth_positions(t, log_.q.middleRows(rows.first, rows.size()), smoothing_);
    const TimeSpan all{t[0], t[t.size() - 1]}, own{std::max(span.begin, all.begin), span.end};
    const std::vector<Index> needed = kept_rows(t, smoothing_, own, all);
    const std::vector<Index> kept = kept_rows(t, smoothing_, own, all, max_experiment_rows);
    require(kept.size() >= fewest_kept_rows, "found " + std::to_string(t.size()) + " rows, of which " +
                                                 std::to_string(kept.size()) +
                                                 " can be compared since smoothing the positions takes some at each "
                                                 "end; expected at least " +
                                                 std::to_string(fewest_kept_rows) + ": log a longer motion");
    for (int k = 0; k < joints_; ++k)
      readings[log_.family + std::to_string(k + 1)].push_back(loads(needed, Eigen::all).col(k));
    cell::Experiment out = motion_experiment(span, number);
    out.joint_reference = cell::JointReference::Measured;
    out.speed_noise = smoothing_.speed_noise;
    const VectorXd at = t(kept);
    out.data = motion_table(at, {{"qc", positions_at(smooth, at)}, {log_.family, loads(kept, Eigen::all)}}, joints_);
    return out;
  }

 private:
  const MotionLog& log_;
  int joints_;
  Smoothing smoothing_;
};

cell::Experiment commanded_experiment(const MotionLog& log, bool measured, int joints, const MotionSpan& span,
                                      std::size_t number) {
  std::vector<Index> rows;
  for (Index i = 0; i < log.t.size(); ++i)
    if (log.t[i] >= span.begin && log.t[i] < span.end) rows.push_back(i);
  std::vector<std::pair<std::string, MatrixXd>> families = {{"qc", log.command(rows, Eigen::all)}};
  if (!log.family.empty()) families.emplace_back(log.family, log.loads(rows, Eigen::all));
  if (measured) families.emplace_back("q", log.q(rows, Eigen::all));
  cell::Experiment out = motion_experiment(span, number);
  const VectorXd gain = log.servo_gain.size() > 0 ? VectorXd(log.servo_gain(rows)) : VectorXd();
  out.data = motion_table(log.t(rows), families, joints, gain);
  return cell::split_lead_in(out, span.lead_in);
}

void add_notes(const std::vector<MotionSpan>& spans, const Smoothing* smoothing, std::vector<LogNote>& notes) {
  if (smoothing) {
    notes.push_back({.kind = LogNoteKind::MeasuredForCommand});
    if (smoothing->even_step > 0) notes.push_back({.kind = LogNoteKind::EvenClock});
    if (smoothing->smooths) notes.push_back({.kind = LogNoteKind::SmoothedPositions, .value = smoothing->cutoff});
  }
  const auto stretches = std::count_if(spans.begin(), spans.end(), [](const MotionSpan& s) { return s.stretch; });
  if (stretches > 0) notes.push_back({.kind = LogNoteKind::Stretches, .value = static_cast<double>(stretches)});
  if (spans.front().cut == CutReason::Uncut) return;
  double cut = 0.0;
  for (const MotionSpan& span : spans)
    if (span.split == cell::Split::Fit) cut = std::max(cut, span.end);
  const bool rest = spans.front().cut == CutReason::AtRest;
  notes.push_back({.kind = rest ? LogNoteKind::CutAtRest : LogNoteKind::Cut, .value = cut});
}

}  // namespace

double settle_time(const cell::Cell& cell, const VectorXd& q) {
  double out = 0.0;
  if (!cell.servo) return out;
  for (const cell::SecondOrder& s : cell.servo->joint)
    out = std::max(out, settled / (s.damping_ratio * s.natural_frequency) + s.delay);
  if (!cell.has_torque_servos()) return out;
  const VectorXd inertia = physics::EffectiveArm(cell).dynamics(0.0).mass_matrix(q).diagonal() +
                           physics::EffectiveDrives(cell).rotor_matrix().diagonal();
  for (int k = 0; k < cell.robot.joints(); ++k) out = std::max(out, settle_time(cell.servo->torque_of(k), inertia[k]));
  return out;
}

void require_masses(const cell::Cell& model) {
  require(!model.robot.links.empty(),
          "the model states no masses of its links, from which torques follow; choose a model with masses and inertias "
          "(in a URDF: <inertial> of each link)");
}

LogRecording record_log(const ArmLog& log, const cell::Cell& cell) {
  const int n = cell.robot.joints();
  log.validate(n);
  require_masses(cell);
  const MotionLog motion = motion_log(log, cell);
  require(!motion.family.empty() || cell.has_torque_servos(),
          "effort: found neither efforts nor currents, and the model states no torque servos, by which commands move "
          "the arm; log efforts, or state the servos (servo.torque: stiffness, damping)");
  require(
      joints_move(motion.q),
      "q: no joint moves; an arm at rest shows gravity only, which many causes explain alike; log a motion of every "
      "joint");
  const std::vector<MotionSpan> spans = split_motions({{.t = motion.t,
                                                        .q = motion.q,
                                                        .command = motion.command,
                                                        .commanded = motion.commanded,
                                                        .stepwise = motion.commanded && cell.has_torque_servos(),
                                                        .settle = settle_time(cell, motion.q.row(0).transpose())}});
  LogRecording out;
  out.recording.cell = cell;
  if (motion.commanded) {
    for (const MotionSpan& span : spans)
      out.recording.experiments.push_back(
          commanded_experiment(motion, log.q.size() > 0, n, span, out.recording.experiments.size() + 1));
    add_notes(spans, nullptr, out.notes);
    return out;
  }
  const MeasuredMotions motions(motion, n, spans);
  for (const MotionSpan& span : spans)
    out.recording.experiments.push_back(motions.experiment(span, out.recording.experiments.size() + 1, out.readings));
  add_notes(spans, &motions.smoothing(), out.notes);
  return out;
}

}  // namespace kr5::arm_log
