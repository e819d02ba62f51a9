// SPDX-License-Identifier: BSD-3-Clause
#include "gap/screening/recording_faults.hpp"

#include <algorithm>

#include <kr5/core/delayed_log.hpp>
#include <kr5/core/error.hpp>

namespace kr5::gap {
namespace {

/// Offset that a clock often has: half a usual control cycle [s].
constexpr double usual_clock_offset = 0.006;

/// Columns of one clock, in experiments of these kinds.
struct Clock {
  std::string target;
  std::vector<cell::Kind> kinds;
  std::string group;  ///< Of cell::columns.
  int joints = 0;
  bool early_only = false;  ///< Late is an effect of the catalogue, in a cell that states its servo.

  bool counts(cell::Kind kind) const { return std::find(kinds.begin(), kinds.end(), kind) != kinds.end(); }
  /// The columns that it stamps, of those that a table has.
  std::vector<int> columns(cell::Kind kind, const io::Table& table) const {
    std::vector<int> out;
    for (const cell::Column& c : cell::columns(kind, joints))
      if (c.role == cell::Role::Predicted && c.group == group && table.find(c.name) >= 0)
        out.push_back(table.find(c.name));
    return out;
  }
};

constexpr const char* wrench_of_contact = "wrench of contact";

std::vector<Clock> all_clocks() {
  using enum cell::Kind;
  return {{"wrench of motion", {Motion}, "wrench"},        {"joint angles", {Motion}, "positions"},
          {"motor currents", {Motion}, "currents"},        {"joint torques", {Motion}, "torques"},
          {wrench_of_contact, {Press, Profile}, "wrench"}, {"wrench", {Motion, Press, Profile}, "wrench"}};
}

/// A column that is written late, run by run.
Eigen::VectorXd delayed_runs(const Eigen::VectorXd& t, const Eigen::VectorXd& run, const Eigen::VectorXd& values,
                             double delay) {
  Eigen::VectorXd out(values.size());
  for (Eigen::Index first = 0, last = 0; first < t.size(); first = last) {
    while (last < t.size() && run(last) == run(first)) ++last;
    const auto rows = Eigen::seq(first, last - 1);
    out(rows) = delayed_log(t(rows), values(rows), delay);
  }
  return out;
}

void shift(io::Table& table, const cell::Experiment& e, const Clock& clock, double delay) {
  const int t = e.data.find("t");
  if (t < 0 || !clock.counts(e.kind)) return;
  const std::string name = cell::run_column(e.kind);
  const int at = name.empty() ? -1 : e.data.find(name);
  const Eigen::VectorXd run =
      at < 0 ? Eigen::VectorXd::Zero(e.data.values.rows()) : Eigen::VectorXd(e.data.values.col(at));
  for (const int column : clock.columns(e.kind, table))
    table.values.col(column) = delayed_runs(e.data.values.col(t), run, table.values.col(column), delay);
}

bool recorded_experiment(const cell::Recording& recording, const Clock& clock) {
  return std::any_of(recording.experiments.begin(), recording.experiments.end(), [&](const cell::Experiment& e) {
    return clock.counts(e.kind) && e.data.find("t") >= 0 && !clock.columns(e.kind, e.data).empty();
  });
}

}  // namespace

std::vector<Hypothesis> recording_faults(const cell::Recording& recording) {
  std::vector<Clock> clocks = all_clocks();
  for (Clock& clock : clocks) {
    clock.joints = recording.cell.robot.joints();
    clock.early_only = clock.group == "currents" && recording.cell.servo.has_value();
  }
  // One clock for the wrench of all kinds, where there is more than one.
  const auto contact = std::ranges::find(clocks, wrench_of_contact, &Clock::target);
  if (!recorded_experiment(recording, *contact))
    std::erase_if(clocks, [](const Clock& c) { return c.kinds.size() > 1; });
  std::vector<Hypothesis> out;
  for (const Clock& clock : clocks) {
    if (!recorded_experiment(recording, clock)) continue;
    Hypothesis h;
    h.effect = "clock_offset";
    h.target = clock.target;
    Coordinate delay;
    delay.name = "delay";
    delay.unit = "s";
    delay.size = usual_clock_offset;
    if (clock.early_only) delay.upper = 0.0;
    h.coordinates = {delay};
    h.probes = {{{Eigen::VectorXd::Constant(1, clock.early_only ? -0.5 : 0.5)}}};
    h.change = [clock](io::Table& table, const cell::Experiment& e, const Eigen::VectorXd& x) {
      shift(table, e, clock, usual_clock_offset * x(0));
    };
    h.of_recording = true;
    out.push_back(std::move(h));
  }
  return out;
}

ClockFault clock_fault(const std::string& target) {
  for (const Clock& clock : all_clocks())
    if (clock.target == target) return {clock.group, clock.kinds};
  throw InvalidArgument("found no clock '" + target + "'");
}

}  // namespace kr5::gap
