// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/best_arm.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include <kr5/core/statistics.hpp>

#include "joint_columns.hpp"
#include "load_delay.hpp"
#include "neighbour_correlation.hpp"
#include "noise_colour.hpp"

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double dead_share = 0.1;        // of the spread of the model's loads, below which a column shows nothing
constexpr double unlike = 0.5;            // correlation, from which a column shows the loads in another unit
constexpr double no_weight = 100.0;       // times what a column leaves, which then says nothing for any effect
constexpr double excess_of_chance = 1.3;  // times the power of noise, above which there is more than noise
constexpr double chance_sigmas = 2.0;     // that what a model leaves may seem smaller than it is
constexpr int most_effects_of_log = 16;   // that are searched for in the log of a real arm

/// Columns that show hardly anything where the model shows a load, as of a joint whose effort is not measured.
std::vector<int> dead_columns(const MatrixXd& measured, const MatrixXd& model) {
  std::vector<int> out;
  for (Index k = 0; k < measured.cols(); ++k) {
    const VectorXd a = measured.col(k).array() - measured.col(k).mean(), b = model.col(k).array() - model.col(k).mean();
    const double alike = std::abs(a.dot(b)) / std::max(a.norm() * b.norm(), 1e-300);
    if (a.norm() < dead_share * b.norm() && alike < unlike) out.push_back(static_cast<int>(k));
  }
  return out;
}

std::vector<int> others(const std::vector<int>& joints, int n) {
  std::vector<int> out;
  for (int k = 0; k < n; ++k)
    if (std::find(joints.begin(), joints.end(), k) == joints.end()) out.push_back(k);
  return out;
}

std::vector<cell::Experiment> fitted_motions(const cell::Recording& recording) {
  std::vector<cell::Experiment> out;
  for (const cell::Experiment& e : recording.experiments)
    if (e.split == cell::Split::Fit && on_measured_positions(e)) out.push_back(e);
  return out;
}

/// Correlation of neighbouring rows of noise; 0 of white noise, and of what is more or clearly less than the noise,
/// whose correlation is that of something else.
double noise_correlation(const VectorXd& left, double noise) {
  const double found = left.squaredNorm() / static_cast<double>(left.size()), power = noise * noise;
  if (found > excess_of_chance * power || excess_of_chance * found < power) return 0.0;
  const double correlation = neighbour_correlation(left);
  return correlation < 3 / std::sqrt(static_cast<double>(left.size())) ? 0.0 : correlation;
}

/// Of each column, above what its noise makes of it [unit of the column].
VectorXd beyond_noise(const MatrixXd& left, const VectorXd& noise) {
  const VectorXd power = noise.cwiseAbs2();
  VectorXd chance(power.size());  // of mean squares, of noise that is alike in neighbouring rows more
  for (Index k = 0; k < power.size(); ++k)
    chance[k] = chance_sigmas * power[k] *
                std::sqrt(2.0 * gap::colour_factor(std::pow(noise_correlation(left.col(k), noise[k]), 2)) /
                          static_cast<double>(left.rows()));
  const VectorXd found = left.cwiseAbs2().colwise().mean().transpose();
  return (found - power + chance).cwiseMax(chance).cwiseSqrt();
}

/// The option, or `value` where it stands at its default.
void widen(int& option, int usual, int value) {
  if (option == usual) option = value;
}

}  // namespace

BestArmErrors best_arm_errors(const cell::Recording& recording) {
  const cell::Cell& cell = recording.cell;
  const int n = cell.robot.joints();
  const std::vector<cell::Experiment> fit = fitted_motions(recording);
  if (fit.empty() || !cell.drives) return {};
  std::vector<MatrixXd> measured, nominal;
  for (const cell::Experiment& e : fit) {
    measured.push_back(motion_of(cell, e).tau);
    nominal.push_back(link_loads(cell, e));
  }
  const MatrixXd tau = stacked_rows(measured), model = stacked_rows(nominal);
  BestArmErrors out;
  out.unmeasured = dead_columns(tau, model);
  const BestArm best = best_arm_with_delay(cell, fit, others(out.unmeasured, n));
  out.delay = best.delay;
  // Where the motion determines no such model, its error is not known to be more than chance makes of it.
  MatrixXd left = best.left.size() > 0 ? best.left : MatrixXd::Zero(tau.rows(), n);
  for (const int k : out.unmeasured)
    left.col(k).setConstant(no_weight *
                            std::sqrt((tau - model).col(k).squaredNorm() / static_cast<double>(tau.rows())));
  const std::string family = load_family(fit.front());
  left = in_columns(cell, family, left);
  VectorXd noise(n);
  for (int k = 0; k < n; ++k) noise[k] = cell.noise.of(family == "tau" ? "torque" : "current", k);
  const VectorXd error = beyond_noise(left, noise);
  for (int k = 0; k < n; ++k) {
    if (!(noise[k] > 0)) continue;
    const std::string column = "motion." + family + std::to_string(k + 1);
    out.errors.push_back({column, error[k]});
    if (const double correlation = noise_correlation(left.col(k), noise[k]); correlation > 0)
      out.correlations.push_back({column, correlation});
  }
  return out;
}

std::vector<LogNote> add_noise_colour(cell::Recording& recording) {
  cell::Cell& cell = recording.cell;
  const std::vector<cell::Experiment> fit = fitted_motions(recording);
  if (fit.empty() || !cell.drives) return {};
  const int n = cell.robot.joints();
  const BestArm best = best_arm_with_delay(cell, fit, others({}, n));
  if (best.left.size() == 0) return {};
  const identification::JointMotion motion = merged_motion(cell, fit, best.delay);
  const std::string family = load_family(fit.front());
  const MatrixXd left = in_columns(cell, family, best.left);
  std::vector<double>& noise = family == "i" ? cell.noise.joint_current : cell.noise.joint_torque;
  LogNote out{.kind = LogNoteKind::ColouredNoise, .name = family};
  for (int k = 0; k < n && static_cast<int>(noise.size()) == n; ++k) {
    const NoiseColour colour = noise_colour(motion, left.col(k), k);
    if (colour.sigma <= noise[static_cast<std::size_t>(k)]) continue;
    noise[static_cast<std::size_t>(k)] = colour.sigma;
    out.joints.push_back(k);
    out.values.push_back(colour.sigma);
    out.deviations.push_back(colour.correlation);
  }
  return out.joints.empty() ? std::vector<LogNote>{} : std::vector<LogNote>{out};
}

std::vector<LogNote> notes_of(const BestArmErrors& errors, const cell::Recording& recording) {
  std::vector<LogNote> out;
  if (!errors.unmeasured.empty()) out.push_back({.kind = LogNoteKind::UnmeasuredLoads, .joints = errors.unmeasured});
  if (errors.delay == 0.0) return out;
  const std::vector<cell::Experiment> fit = fitted_motions(recording);
  out.push_back({.kind = LogNoteKind::DelayedLoads, .name = load_family(fit.at(0)), .value = errors.delay});
  return out;
}

gap::DiagnoseOptions widened_search(const gap::DiagnoseOptions& options, const BestArmErrors& errors, int joints) {
  gap::DiagnoseOptions out = options;
  if (errors.errors.empty() || !options.simulator_errors.empty()) return out;
  const gap::DiagnoseOptions usual;
  widen(out.max_effects, usual.max_effects, std::min(2 * joints + 2, most_effects_of_log));
  widen(out.beam, usual.beam, 1);
  widen(out.refits, usual.refits, 4);
  out.simulator_errors = errors.errors;
  if (out.noise_correlations.empty()) out.noise_correlations = errors.correlations;
  out.errors_of_recording = true;
  return out;
}

}  // namespace kr5::arm_log
