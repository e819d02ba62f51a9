// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/log_conditioning.hpp>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/identification/zero_phase.hpp>

#include "identification/log/even_log.hpp"
#include "identification/log/log_checks.hpp"
#include "identification/short_number.hpp"

namespace kr5::identification {

namespace {

constexpr Index shortest_run = 15;          // rows
constexpr double min_cutoff = 1.0;          // [Hz]
constexpr double arm_bandwidth = 25.0;      // above which an arm's speed has only noise [Hz]
constexpr double power_share = 0.99;        // of the speeds, below the bandwidth
constexpr double band_ratio = 1.25;         // of the frequencies of a band in which motion and noise are compared
constexpr double moves_by = 2.0;            // times the power of the noise, from which a band holds motion
constexpr double samples_per_period = 4.0;  // of the cut-off that decimation leaves

std::string trimmed(const std::string& text) {
  const auto from = text.find_first_not_of(" \t"), to = text.find_last_not_of(" \t");
  return from == std::string::npos ? "" : text.substr(from, to - from + 1);
}

/// Rows of the motion so far, one run after the other.
struct MotionRows {
  std::vector<VectorXd> t;
  std::vector<MatrixXd> q, qd, qdd, tau, measured, temperature;
};

MatrixXd stacked(const std::vector<MatrixXd>& parts) {
  Index rows = 0;
  for (const MatrixXd& p : parts) rows += p.rows();
  MatrixXd out(rows, parts.front().cols());
  Index at = 0;
  for (const MatrixXd& p : parts) {
    out.middleRows(at, p.rows()) = p;
    at += p.rows();
  }
  return out;
}

void add_run(const EvenRun& run, const ConditioningOptions& options, const ConditionedMotion& result, MotionRows& out) {
  const MatrixXd q = zero_phase_low_pass(run.q, run.step, result.cutoff, options.filter_order);
  MatrixXd qd = central_differences(q, run.step), qdd = second_differences(q, run.step);
  if (options.speeds == SpeedSource::Logged) {
    qd = zero_phase_low_pass(run.qd, run.step, result.cutoff, options.filter_order);
    qdd = central_differences(qd, run.step);
  }
  // Torques were logged late: those of time t stand in the row of t + delay.
  const VectorXd shifted = run.t.array() - options.torque_delay;
  const MatrixXd measured = options.torque_delay == 0.0 ? run.tau : resampled_log(shifted, run.tau, run.t);
  const MatrixXd tau =
      options.smooth_torques ? zero_phase_low_pass(measured, run.step, result.cutoff, options.filter_order) : measured;
  const auto edge = static_cast<Index>(std::ceil(options.edge / (result.cutoff * run.step)));
  const auto lead = static_cast<Index>(std::ceil(std::max(0.0, -options.torque_delay) / run.step));
  const auto tail = static_cast<Index>(std::ceil(std::max(0.0, options.torque_delay) / run.step));
  std::vector<Index> rows;
  for (Index i = edge + lead; i < run.t.size() - edge - tail; i += result.decimation) rows.push_back(i);
  if (rows.empty()) return;
  out.t.push_back(run.t(rows));
  out.q.push_back(q(rows, Eigen::all));
  out.qd.push_back(qd(rows, Eigen::all));
  out.qdd.push_back(qdd(rows, Eigen::all));
  out.tau.push_back(tau(rows, Eigen::all));
  out.measured.push_back(measured(rows, Eigen::all));
  if (run.temperature.size() == 0) return;
  const MatrixXd smooth = zero_phase_low_pass(run.temperature, run.step, result.cutoff, options.filter_order);
  out.temperature.push_back(smooth(rows, Eigen::all));
}

void collect(const MotionRows& rows, ConditionedMotion& out) {
  Index at = 0;
  for (const VectorXd& t : rows.t) {
    out.motion.run_starts.push_back(static_cast<int>(at));
    at += t.size();
  }
  out.motion.t.resize(at);
  at = 0;
  for (const VectorXd& t : rows.t) {
    out.motion.t.segment(at, t.size()) = t;
    at += t.size();
  }
  out.motion.q = stacked(rows.q);
  out.motion.qd = stacked(rows.qd);
  out.motion.qdd = stacked(rows.qdd);
  out.motion.tau = stacked(rows.tau);
  out.tau_measured = stacked(rows.measured);
  if (!rows.temperature.empty()) out.motion.temperature = stacked(rows.temperature);
}

bool can_be_left_out(LogFault fault) {
  return fault == LogFault::NotFinite || fault == LogFault::Saturated || fault == LogFault::Frozen ||
         fault == LogFault::Brake;
}

void grade(std::vector<LogFinding>& findings, const ConditioningOptions& options) {
  for (LogFinding& f : findings) {
    if (f.severity != LogSeverity::Error) continue;
    const bool left_out = options.leave_out_faulty && can_be_left_out(f.fault);
    if (!left_out && !options.accepts(f.fault)) continue;
    f.severity = LogSeverity::Warning;
    f.text += left_out ? " (left out)" : " (accepted)";
  }
  std::stable_sort(findings.begin(), findings.end(),
                   [](const LogFinding& a, const LogFinding& b) { return a.severity > b.severity; });
}

}  // namespace

void ConditioningOptions::validate() const {
  require(cutoff >= 0 && std::isfinite(cutoff), "cutoff must not be negative; 0: from the data [Hz]");
  require(filter_order >= 1 && filter_order <= 12, "filter_order: 1 to 12");
  require(decimation >= 0, "decimation must not be negative; 0: from the cut-off");
  require(edge >= 0 && std::isfinite(edge), "edge must not be negative [-]");
  require(max_gap > 1, "max_gap: more than one median step [-]");
  require(std::abs(torque_delay) < 1.0, "torque_delay: within a second [s]");
  require(lower.size() == upper.size(), "lower, upper: one limit a joint each, or none");
  std::istringstream words(accept);
  for (std::string word; std::getline(words, word, ',');) {
    word = trimmed(word);
    bool known = word.empty();
    for (const auto& [fault, name] : enum_names(LogFault{})) known = known || name == word;
    require(known, "accept: '" + word + "' is no kind of finding; expected such as reversed_torque, torque_delay");
  }
}

bool ConditioningOptions::accepts(LogFault fault) const {
  std::istringstream words(accept);
  for (std::string word; std::getline(words, word, ',');)
    if (trimmed(word) == name_of(fault)) return true;
  return false;
}

double motion_bandwidth(const Eigen::Ref<const MatrixXd>& q, double step) {
  const double highest = std::min(arm_bandwidth, 0.2 / step);
  // The last column is what unit noise of the angles makes of the speeds, which each joint has its share of.
  MatrixXd angles(q.rows(), q.cols() + 1);
  angles << q, Random(1).normal_vector(q.rows());
  const MatrixXd speed = central_differences(zero_phase_low_pass(angles, step, highest), step);
  VectorXd variance(q.cols());
  for (Index j = 0; j < q.cols(); ++j) variance[j] = std::pow(difference_noise(q.col(j)), 2);
  const auto power_of_motion = [&](const MatrixXd& seen) -> VectorXd {
    const VectorXd power = seen.colwise().squaredNorm().transpose();
    return (power.head(q.cols()) - power[q.cols()] * variance).cwiseMax(0.0);
  };
  const VectorXd power = power_of_motion(speed);
  const auto kept = [&](double f) {
    const VectorXd low = power_of_motion(zero_phase_low_pass(speed, step, f));
    double least = 1.0;
    for (Index j = 0; j < power.size(); ++j)
      if (power[j] > 0.01 * power.maxCoeff()) least = std::min(least, low[j] / power[j]);
    return least;
  };
  double low = std::min(0.05, 0.5 * highest), high = highest;
  for (int i = 0; i < 8 && power.maxCoeff() > 0; ++i) {
    const double middle = std::sqrt(low * high);
    (kept(middle) < power_share ? low : high) = middle;
  }
  return high;
}

double motion_cutoff(const Eigen::Ref<const MatrixXd>& q, double step, const VectorXd& noise) {
  require(noise.size() == q.cols(),
          "noise: expected one a joint, " + std::to_string(q.cols()) + ", found " + std::to_string(noise.size()));
  const double bandwidth = motion_bandwidth(q, step);
  double out = std::min(5 * bandwidth, 0.4 / step);
  MatrixXd seen(q.rows(), q.cols() + 1);
  seen << q, Random(1).normal_vector(q.rows());  // the last column shows what unit noise has in each band
  MatrixXd above = zero_phase_low_pass(seen, step, out);
  while (out > 1.5 * bandwidth) {
    const double next = std::max(out / band_ratio, 1.5 * bandwidth);
    const MatrixXd below = zero_phase_low_pass(seen, step, next);
    const VectorXd power = (above - below).colwise().squaredNorm().transpose();
    const VectorXd of_noise = power[q.cols()] * noise.cwiseAbs2();
    if ((power.head(q.cols()).array() > moves_by * of_noise.array()).any()) break;
    out = next;
    above = below;
  }
  return out;
}

double speed_noise_gain(double step, double cutoff, int filter_order) {
  require(step > 0 && cutoff >= 0, "step must be positive [s], cutoff not negative [Hz]");
  constexpr Index rows = 20'000;
  MatrixXd noise = Random(1).normal_vector(rows);
  if (cutoff > 0) noise = zero_phase_low_pass(noise, step, cutoff, filter_order);
  const MatrixXd speed = central_differences(noise, step);
  return speed.norm() / std::sqrt(static_cast<double>(rows));
}

std::vector<LogFinding> check_log(const JointLog& log, const ConditioningOptions& options) {
  log.validate();
  options.validate();
  std::vector<LogFinding> out = scan_log(log, options).findings;
  grade(out, options);
  return out;
}

ConditionedMotion condition_log(const JointLog& log, const ConditioningOptions& options) {
  log.validate();
  options.validate();
  require(options.speeds == SpeedSource::Positions || log.qd.size() > 0, "speeds: logged, but the log has no speeds");
  LogScan scan = scan_log(log, options);
  grade(scan.findings, options);
  ConditionedMotion out;
  out.findings = scan.findings;
  if (!out.findings.empty() && out.findings.front().severity == LogSeverity::Error) {
    out.message = out.findings.front().text;
    return out;
  }
  OrderedLog& data = scan.ordered;
  if (!options.leave_out_faulty)
    std::fill(data.faulty.begin(), data.faulty.end(), char{0});  // what is faulty is accepted
  out.step = data.step;
  const std::vector<RowRange> runs = log_runs(data, longest_step(data, options), shortest_run);
  if (runs.empty()) {
    out.message = "no run of " + std::to_string(shortest_run) + " rows without a gap";
    return out;
  }
  const RowRange& longest = *std::max_element(runs.begin(), runs.end(),
                                              [](const RowRange& a, const RowRange& b) { return a.size() < b.size(); });
  out.cutoff = options.cutoff > 0
                   ? options.cutoff
                   : std::clamp(5 * motion_bandwidth(data.log.q.middleRows(longest.first, longest.size()), data.step),
                                std::min(min_cutoff, 0.4 / data.step), 0.4 / data.step);
  require(out.cutoff < 0.5 / data.step, "cutoff: found " + short_number(out.cutoff) + " Hz, expected less than " +
                                            short_number(0.5 / data.step) + " Hz, half the rate of the log");
  out.decimation = options.decimation > 0 ? options.decimation
                   : !options.smooth_torques
                       ? 1  // nothing else averages the noise of the torques
                       : std::max(1, static_cast<int>(1 / (samples_per_period * out.cutoff * data.step)));
  MotionRows rows;
  for (const RowRange& run : runs) add_run(even_run(data, run, options.clock, out.even_clock), options, out, rows);
  if (rows.t.empty()) {
    out.message = "no row is left between the edges of the runs; lower edge, or raise cutoff";
    return out;
  }
  collect(rows, out);
  out.message = std::to_string(out.motion.samples()) + " rows in " + std::to_string(rows.t.size()) +
                " runs, low-passed at " + short_number(out.cutoff) + " Hz";
  return out;
}

ConditioningOptions conditioning_like(std::span<const ConditionedMotion> motions, const ConditioningOptions& options) {
  ConditioningOptions out = options;
  const bool usable = std::all_of(motions.begin(), motions.end(), [](const auto& motion) { return motion.usable(); });
  if (motions.empty() || !usable || options.cutoff > 0) return out;
  std::vector<double> cutoffs, decimations;
  for (const ConditionedMotion& motion : motions)
    cutoffs.push_back(motion.cutoff), decimations.push_back(motion.decimation);
  out.cutoff = midpoint_median(cutoffs);
  if (out.decimation == 0) out.decimation = static_cast<int>(std::nearbyint(midpoint_median(decimations)));
  return out;
}

}  // namespace kr5::identification
