// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/reading_noise.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <kr5/core/statistics.hpp>

#include "joint_columns.hpp"

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double min_noise = 3e-3;  // of the spread of a load: what a log without noise has of rounding
constexpr double smallest_noise = 1e-9;

using Parts = std::vector<VectorXd>;

/// The readings of a column, or its rows in the experiments.
Parts readings_of(const Readings& readings, const std::vector<const cell::Experiment*>& logs,
                  const std::string& column) {
  if (const auto found = readings.find(column); found != readings.end()) return found->second;
  Parts out;
  for (const cell::Experiment* e : logs) out.push_back(e->data.column(column));
  return out;
}

double spread_of(const Parts& parts) {
  double sum = 0.0, squares = 0.0, count = 0.0;
  for (const VectorXd& x : parts) sum += x.sum(), count += static_cast<double>(x.size());
  for (const VectorXd& x : parts) squares += (x.array() - sum / count).square().sum();
  return std::sqrt(squares / count);
}

/// Whether a cell states the noise of currents or joint torques; `torque` is that of the wrist sensor, where there is
/// one.
bool states_noise(const cell::Noise& noise, const std::string& family) {
  if (family == "i") return noise.current > 0 || !noise.joint_current.empty();
  return !noise.joint_torque.empty() || (noise.torque > 0 && noise.force == 0);
}

/// Noise of the joint torques that that of the currents makes.
std::vector<double> torque_noise(const cell::Drives& drives, double current) {
  const Eigen::MatrixXd shares = drives.structure.transpose() * drives.torque_constant.asDiagonal() * current;
  const VectorXd norms = shares.rowwise().norm();
  return {norms.begin(), norms.end()};
}

void add_joint_noise(cell::Recording& recording, const Readings& readings, const std::string& family,
                     std::vector<LogNote>& notes) {
  std::vector<const cell::Experiment*> logs;
  for (const cell::Experiment& e : recording.experiments)
    if (has_column(e, family + "1")) logs.push_back(&e);
  cell::Cell& cell = recording.cell;
  if (logs.empty() || states_noise(cell.noise, family)) return;
  if (family == "tau" && cell.drives && cell.noise.current > 0) {
    cell.noise.joint_torque = torque_noise(*cell.drives, cell.noise.current);
    notes.push_back({.kind = LogNoteKind::TorqueNoise});
    return;
  }
  std::vector<double> sigma;
  for (int k = 0; k < cell.robot.joints(); ++k) {
    const Parts parts = readings_of(readings, logs, family + std::to_string(k + 1));
    sigma.push_back(std::max(noise_of_readings(parts), min_noise * spread_of(parts)));
  }
  (family == "i" ? cell.noise.joint_current : cell.noise.joint_torque) = sigma;
  notes.push_back({.kind = LogNoteKind::JointNoise, .name = family, .values = sigma});
}

/// The noise of columns that share one value: the middle one of theirs.
void add_channel_noise(cell::Recording& recording, const Readings& readings, const std::string& key, double& value,
                       const std::vector<std::string>& columns, std::vector<LogNote>& notes) {
  std::vector<const cell::Experiment*> logs;
  for (const cell::Experiment& e : recording.experiments)
    if (e.kind == cell::Kind::Motion && has_column(e, columns.front())) logs.push_back(&e);
  if (logs.empty() || value > 0) return;
  std::vector<double> found;
  for (const std::string& column : columns)
    if (has_column(*logs.front(), column)) found.push_back(noise_of_readings(readings_of(readings, logs, column)));
  std::sort(found.begin(), found.end());
  const std::size_t middle = found.size() / 2;
  value = found.size() % 2 == 1 ? found[middle] : 0.5 * (found[middle - 1] + found[middle]);
  notes.push_back({.kind = LogNoteKind::ChannelNoise, .name = key, .value = value});
}

}  // namespace

double noise_of_readings(const std::vector<VectorXd>& parts) {
  std::vector<double> third;
  double step = std::numeric_limits<double>::infinity();
  for (const VectorXd& x : parts)
    for (Index i = 1; i < x.size(); ++i) {
      if (const double d = std::abs(x[i] - x[i - 1]); d > 0) step = std::min(step, d);
      if (i >= 3) third.push_back(std::abs(x[i] - 3 * x[i - 1] + 3 * x[i - 2] - x[i - 3]));
    }
  const double sigma = mad_to_sigma * median(std::move(third)) / std::sqrt(20.0);
  const double coarse = std::isfinite(step) ? step / std::sqrt(12.0) : 0.0;
  return std::max({sigma, coarse, smallest_noise});
}

std::vector<LogNote> add_reading_noise(cell::Recording& recording, const Readings& readings) {
  std::vector<LogNote> notes;
  for (const char* family : {"i", "tau"}) add_joint_noise(recording, readings, family, notes);
  cell::Noise& noise = recording.cell.noise;
  std::vector<std::string> positions;
  for (int k = 0; k < recording.cell.robot.joints(); ++k) positions.push_back("q" + std::to_string(k + 1));
  add_channel_noise(recording, readings, "position", noise.position, positions, notes);
  add_channel_noise(recording, readings, "force", noise.force, {"fx", "fy", "fz"}, notes);
  add_channel_noise(recording, readings, "torque", noise.torque, {"tx", "ty", "tz"}, notes);
  return notes;
}

}  // namespace kr5::arm_log
