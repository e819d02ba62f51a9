// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/servo.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <kr5/core/error.hpp>
#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "identification/drives/servo_response.hpp"
#include "identification/log/residual_correlation.hpp"
#include "identification/log/runs.hpp"
#include "identification/short_number.hpp"

namespace kr5::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using physics::RowRange;
using Vector5 = Eigen::Matrix<double, 5, 1>;  // log wn, log zeta, delay, gain, offset

void ServoOptions::validate() const {
  require(max_delay > 0 && std::isfinite(max_delay), "max_delay must be positive [s]");
  require(accepted_std > 0 && std::isfinite(accepted_std), "accepted_std must be positive [-]");
}

void ServoLog::validate() const {
  require(t.size() > 0, "t: no sample");
  for (const auto& [name, values] :
       {std::pair<std::string, const VectorXd*>{"t", &t}, {"command", &command}, {"response", &response}}) {
    require(values->size() == t.size(),
            name + ": expected " + std::to_string(t.size()) + " numbers, found " + std::to_string(values->size()));
    for (Index i = 0; i < values->size(); ++i)
      require(std::isfinite((*values)[i]), name + ": row " + std::to_string(i) + " is not finite");
  }
  require_run_starts(run_starts, t.size());
  require_rising_times(t, run_starts);
}

namespace {

/// Residuals of a log in units of the span of its commands, so that every tolerance is a plain number.
class ServoProblem {
 public:
  ServoProblem(const ServoLog& log, const ServoOptions& options)
      : log_(log),
        options_(options),
        runs_(runs_of(log.run_starts, log.t.size())),
        span_(log.command.maxCoeff() - log.command.minCoeff()) {
    double longest = 0.0;
    for (const RowRange& run : runs_) longest = std::max(longest, log.t[run.last - 1] - log.t[run.first]);
    const double cycle = std::max(median_cycle(log, runs_), 1e-9);
    slowest_ = 0.3 / std::max(longest, cycle);
    fastest_ = 2 * std::numbers::pi / cycle;
    constexpr double free = 1e9;
    box.lower << std::log(slowest_ / 10), std::log(0.01), -options.max_delay, -free, -free;
    box.upper << std::log(fastest_), std::log(30.0), options.max_delay, free, free;
  }

  static cell::SecondOrder servo_of(const Vector5& x) { return {std::exp(x[0]), std::exp(x[1]), x[2]}; }

  VectorXd residuals(const Vector5& x) const {
    const auto response = servo_response(servo_of(x), log_, runs_, options_.command);
    return (x[3] * response.col(0).array() + x[4] - log_.response.array()) / span_;
  }

  /// Derivatives of the residuals, zero for what is not estimated.
  MatrixXd jacobian(const Vector5& x) const {
    constexpr double h = 1e-6;
    MatrixXd out(log_.t.size(), 5);
    for (int i = 0; i < 2; ++i) out.col(i) = (residuals(x + h * unit(i)) - residuals(x - h * unit(i))) / (2 * h);
    const auto response = servo_response(servo_of(x), log_, runs_, options_.command);
    out.col(2) = -x[3] / span_ * response.col(1);  // a later command moves the response in time as a whole
    out.col(3) = options_.fit_gain ? VectorXd(response.col(0) / span_) : VectorXd::Zero(log_.t.size());
    out.col(4).setConstant(options_.fit_offset ? 1 / span_ : 0.0);
    return out;
  }

  NormalEquations<5> equations(const Vector5& x) const {
    const VectorXd r = residuals(x);
    const MatrixXd J = jacobian(x);
    NormalEquations<5> out;
    out.information = J.transpose() * J;
    out.gradient = J.transpose() * r;
    out.cost = r.squaredNorm();
    out.count = static_cast<int>(r.size());
    return out;
  }
  double cost(const Vector5& x) const { return residuals(x).squaredNorm(); }

  /// Gain and offset that fit best to the rest of x.
  Vector5 with_best_gain(Vector5 x) const {
    const VectorXd h = servo_response(servo_of(x), log_, runs_, options_.command).col(0);
    const VectorXd& z = log_.response;
    if (options_.fit_gain && options_.fit_offset) {
      const VectorXd about = h.array() - h.mean();
      if (about.squaredNorm() > 0) x[3] = about.dot(z) / about.squaredNorm();
      x[4] = z.mean() - x[3] * h.mean();
    } else if (options_.fit_gain) {
      if (h.squaredNorm() > 0) x[3] = h.dot(z) / h.squaredNorm();
    } else if (options_.fit_offset) {
      x[4] = (z - h).mean();
    }
    return x;
  }

  /// The best points of a coarse grid, best first.
  std::vector<Vector5> starts(std::size_t count) const {
    constexpr int frequencies = 16;
    constexpr std::array dampings = {0.4, 0.8, 1.5};
    const std::array delays = {-0.2 * options_.max_delay, 0.0, 0.04 * options_.max_delay, 0.15 * options_.max_delay,
                               0.5 * options_.max_delay};
    std::vector<std::pair<double, Vector5>> all;
    for (int i = 0; i < frequencies; ++i)
      for (const double zeta : dampings)
        for (const double delay : delays) {
          const double part = i / (frequencies - 1.0);
          Vector5 x;
          x << std::lerp(std::log(slowest_), std::log(fastest_ / 4), part), std::log(zeta), delay, 1.0, 0.0;
          x = with_best_gain(x);
          all.emplace_back(cost(x), x);
        }
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Vector5> out;
    for (std::size_t k = 0; k < std::min(count, all.size()); ++k) out.push_back(all[k].second);
    return out;
  }

  const std::vector<RowRange>& runs() const { return runs_; }
  double span() const { return span_; }

  Box<5> box;

 private:
  static Vector5 unit(int i) { return Vector5::Unit(i); }

  const ServoLog& log_;
  const ServoOptions& options_;
  std::vector<RowRange> runs_;
  double span_, slowest_ = 0.0, fastest_ = 0.0;
};

ServoResult refused_servo(ServoResult result, std::string message) {
  result.fit.status = FitStatus::Degenerate;
  result.fit.message = std::move(message);
  return result;
}

/// Covariance in the units of the result, from that of the parameters of the problem.
void set_covariance(ServoResult& out, const ServoProblem& problem, const Vector5& x, const VectorXd& residuals) {
  const MatrixXd J = problem.jacobian(x);
  std::vector<Index> free;
  for (Index i = 0; i < 5; ++i)
    if (J.col(i).squaredNorm() > 0) free.push_back(i);
  const auto found = correlated_covariance(J(Eigen::all, free), residuals, problem.runs());
  out.noise = problem.span() * std::sqrt(found.variance);
  out.correlation = found.inflation;
  out.covariance = MatrixXd::Zero(5, 5);
  if (found.covariance.size() == 0) return;
  out.covariance(free, free) = found.covariance;
  const Vector5 scale(out.servo.natural_frequency, out.servo.damping_ratio, 1.0, 1.0, 1.0);
  out.covariance = (scale.asDiagonal() * out.covariance * scale.asDiagonal()).eval();
}

/// What is wrong with an estimate; empty when nothing is.
std::string servo_objection(const ServoResult& found, const ServoLog& log, const std::vector<RowRange>& runs,
                            const ServoOptions& options) {
  const double std_wn = std::sqrt(found.covariance(0, 0)), std_delay = std::sqrt(found.covariance(2, 2));
  const double relative = std_wn / found.servo.natural_frequency;
  const double at_rest = (log.response.array() - log.response.mean()).square().sum();
  const double explained = at_rest - (log.response - found.predicted).squaredNorm();
  constexpr double chance = 1e-9, parameters = 5;
  const bool follows = explained > uncertainty::chi_square_quantile(1 - chance, parameters) * found.correlation *
                                       found.noise * found.noise;
  if (!follows || !(relative > 0) || relative > options.accepted_std || found.gain <= 0)
    return "the response does not show the command: natural frequency known to " + short_number(100 * relative) +
           " %, gain " + short_number(found.gain) +
           "; the step is too small against the noise, or the columns do not belong together";
  if (found.servo.delay < -3 * std_delay && found.servo.delay < -0.5 * found.cycle)
    return "the response comes " + short_number(-found.servo.delay) +
           " s before the command: two clocks, or command and response exchanged";
  if (const auto plateau = find_speed_plateau(log, runs, found);
      plateau && found.noise > 2 * neighbour_noise(log.response, runs))
    return "the speed is limited to " + short_number(plateau->speed) + " m/s or rad/s from " +
           short_number(plateau->from) + " to " + short_number(plateau->to) +
           " s: the servo is not linear there; use a smaller step";
  return {};
}

void add_servo_warnings(ServoResult& out, const ServoLog& log, const std::vector<RowRange>& runs) {
  const auto correlation = [&](int i, int j) {
    return out.covariance(i, j) / std::sqrt(out.covariance(i, i) * out.covariance(j, j));
  };
  constexpr double tied = 0.98, vague = 0.05;  // what is tied does not matter while it is known well
  const double relative = std::sqrt(out.covariance(0, 0)) / out.servo.natural_frequency;
  const std::array<std::pair<int, std::string>, 2> others = {{{1, "damping ratio"}, {2, "delay"}}};
  for (const auto& [index, name] : others)
    if (std::abs(correlation(0, index)) > tied && relative > vague)
      out.warnings.push_back("natural frequency and " + name + " are determined only together (correlation " +
                             short_number(correlation(0, index)) + "): sample faster, or excite faster");
  if (out.overshoot && out.overshoot->second_overshoot < 2 * out.noise)
    out.overshoot_limits.push_back(
        "the second overshoot would be " + short_number(out.overshoot->second_overshoot) + " against noise of " +
        short_number(out.noise) +
        " m or rad: a spacing of peaks cannot be read; the period is twice the time to the first");
  const double scatter = neighbour_noise(log.response, runs);
  if (scatter > 0 && out.noise > 3 * scatter)
    out.warnings.push_back("the residuals are " + short_number(out.noise / scatter) +
                           " times the scatter between neighbouring samples: a servo of second order with a constant "
                           "delay does not explain all of the response");
}

}  // namespace

ServoResult identify_servo(const ServoLog& log, const ServoOptions& options) {
  options.validate();
  log.validate();
  ServoResult out;
  constexpr Index fewest = 10;
  if (log.t.size() < fewest)
    return refused_servo(out, "found " + std::to_string(log.t.size()) + " samples, expected at least 10");
  ServoProblem problem(log, options);
  if (!(problem.span() > 0)) return refused_servo(out, "the command does not change: log a step or a motion");

  LevenbergMarquardtResult<5, Vector5> best;
  for (const Vector5& start : problem.starts(3)) {
    auto found = levenberg_marquardt<5>(start, problem, {.max_iterations = 200});
    if (!(found.equations.cost >= best.equations.cost) || out.fit.iterations == 0) {
      if (out.fit.iterations == 0)
        out.fit.initial_rms = std::sqrt(problem.cost(start) / static_cast<double>(log.t.size()));
      best = found;
    }
    out.fit.iterations += found.iterations;
  }
  if (!best.usable() && best.status != LevenbergMarquardtStatus::MaxIterations)
    return refused_servo(out, "the estimation failed: the response does not follow from the command");
  out.servo = ServoProblem::servo_of(best.x);
  out.gain = best.x[3];
  out.offset = best.x[4];
  out.cycle = median_cycle(log, problem.runs());
  const auto response = servo_response(out.servo, log, problem.runs(), options.command);
  out.predicted = out.gain * response.col(0).array() + out.offset;
  out.max_speed = std::abs(out.gain) * response.col(1).cwiseAbs().maxCoeff();
  set_covariance(out, problem, best.x, problem.residuals(best.x));
  out.fit.initial_rms *= problem.span() / std::max(out.noise, 1e-300);
  out.fit.final_rms = 1.0;  // the noise is estimated from the residuals
  if (const std::string wrong = servo_objection(out, log, problem.runs(), options); !wrong.empty())
    return refused_servo(out, wrong);
  out.overshoot = read_overshoot(log, problem.runs(), out);
  add_servo_warnings(out, log, problem.runs());
  out.fit.status = best.usable() ? FitStatus::Converged : FitStatus::MaxIterations;
  out.fit.message = best.usable() ? "converged" : "stopped at the limit of iterations";
  return out;
}

}  // namespace kr5::identification
