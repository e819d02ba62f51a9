// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/contact_stiffness.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <kr5/core/error.hpp>
#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/core/random.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "identification/log/residual_correlation.hpp"
#include "identification/log/runs.hpp"
#include "identification/short_number.hpp"

namespace kr5::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using physics::RowRange;

void ContactStiffnessOptions::validate() const {
  require(position_noise >= 0 && std::isfinite(position_noise), "position_noise must not be negative [m]");
  require(force_noise >= 0 && std::isfinite(force_noise), "force_noise must not be negative [N]");
  require(outlier_limit >= 2 && std::isfinite(outlier_limit), "outlier_limit must be 2 or more [-]");
  require(accepted_std > 0 && std::isfinite(accepted_std), "accepted_std must be positive [-]");
  require(seed >= 0, "seed must not be negative");
}

void ContactLog::validate() const {
  require(depth.size() > 0, "depth: no reading");
  const auto check = [&](const std::string& name, const VectorXd& values) {
    require(values.size() == depth.size(),
            name + ": expected " + std::to_string(depth.size()) + " numbers, found " + std::to_string(values.size()));
    for (Index i = 0; i < values.size(); ++i)
      require(std::isfinite(values[i]), name + ": row " + std::to_string(i) + " is not finite");
  };
  check("depth", depth);
  check("force", force);
  if (t.size() > 0) check("t", t);
  require_run_starts(run_starts, depth.size());
  if (t.size() > 0) require_rising_times(t, run_starts);
}

namespace {

enum ContactParameter : Index { Stiffness, Position, ForceOffset, Damping, Hardening, Unloading, ContactParameters };
using ContactVector = Eigen::Matrix<double, ContactParameters, 1>;

/// Slopes of lines through up to five neighbours.
VectorXd approach_speed(const ContactLog& log, const std::vector<RowRange>& runs) {
  VectorXd out = VectorXd::Zero(log.depth.size());
  if (log.t.size() == 0) return out;
  for (const RowRange& run : runs)
    for (Index i = run.first; i < run.last; ++i) {
      const Index from = std::max(run.first, i - 2), n = std::min(run.last, i + 3) - from;
      const VectorXd about = log.t.segment(from, n).array() - log.t.segment(from, n).mean();
      if (n > 1) out[i] = about.dot(log.depth.segment(from, n)) / about.squaredNorm();
    }
  return out;
}

/// Whether a reading belongs to a way out: the depth turned by more than `threshold` and has not turned back.
std::vector<bool> way_out(const VectorXd& depth, const std::vector<RowRange>& runs, double threshold) {
  std::vector<bool> out(static_cast<std::size_t>(depth.size()), false);
  for (const RowRange& run : runs) {
    Index extreme = run.first;  // the last turning point as far as it is known
    bool receding = false;
    for (Index i = run.first; i < run.last; ++i) {
      const double beyond = receding ? depth[extreme] - depth[i] : depth[i] - depth[extreme];
      if (beyond >= 0) extreme = i;
      if (-beyond > threshold) {
        receding = !receding;
        for (Index k = extreme + 1; k < i; ++k) out[static_cast<std::size_t>(k)] = receding;
        extreme = i;
      }
      out[static_cast<std::size_t>(i)] = receding;
    }
  }
  return out;
}

/// What one reading says at a set of parameters: in contact or not, and its residuals in standard deviations.
struct ContactReading {
  bool contact = false;
  double residual = 0.0;
  ContactVector derivatives = ContactVector::Zero();
  double before = 0.0;  ///< Depth beyond the contact position of a reading without contact, in standard deviations.
};

class ContactProblem {
 public:
  ContactProblem(const ContactLog& log, std::vector<RowRange> runs, const ContactStiffnessOptions& options)
      : log_(log),
        runs_(std::move(runs)),
        speed_(approach_speed(log, runs_)),
        weight(VectorXd::Ones(log.depth.size())),
        position_noise(options.position_noise) {
    const double range = log.depth.maxCoeff() - log.depth.minCoeff();
    receding_ = way_out(log.depth, runs_, std::max(0.02 * range, 6 * position_noise));
    held[Damping] = !options.fit_damping;
    held[Hardening] = !options.fit_hardening;
  }

  double stiffness(const ContactVector& x, Index i) const { return x[Stiffness] + (receding(i) ? x[Unloading] : 0.0); }
  double depth(Index i) const { return log_.depth[i]; }
  bool receding(Index i) const { return receding_[static_cast<std::size_t>(i)]; }

  double contact_force(const ContactVector& x, Index i, double p) const {
    return stiffness(x, i) * p * (1 + x[Hardening] * p) + x[Damping] * speed_[i];
  }

  double predicted(const ContactVector& x, Index i) const {
    const double p = log_.depth[i] - x[Position];
    return x[ForceOffset] + (p > 0 ? std::max(contact_force(x, i, p), 0.0) : 0.0);
  }

  ContactReading read(const ContactVector& x, Index i) const {
    const double p = log_.depth[i] - x[Position], k = stiffness(x, i), force = log_.force[i] - x[ForceOffset];
    const double slope = k * (1 + 2 * x[Hardening] * p), error = force - contact_force(x, i, p);
    const double s = std::hypot(force_noise, slope * position_noise);
    const double nearest = p + position_noise * position_noise * slope * error / (s * s);  // on the line
    ContactReading out;
    out.residual = force / force_noise;
    if (p > 0) out.before = position_noise > 0 ? p / position_noise : std::numeric_limits<double>::infinity();
    out.contact = nearest > 0 && std::abs(error / s) <= std::hypot(out.residual, out.before);
    if (!out.contact) {
      out.derivatives[ForceOffset] = -1 / force_noise;
      return out;
    }
    // Derivatives at the nearest point of the line are those of the orthogonal distance, its weight included.
    out.before = 0.0;
    out.residual = error / s;
    out.derivatives[Stiffness] = -nearest * (1 + x[Hardening] * nearest) / s;
    out.derivatives[Position] = slope / s;
    out.derivatives[ForceOffset] = -1 / s;
    out.derivatives[Damping] = -speed_[i] / s;
    out.derivatives[Hardening] = -k * nearest * nearest / s;
    if (receding(i)) out.derivatives[Unloading] = out.derivatives[Stiffness];
    return out;
  }

  NormalEquations<ContactParameters> equations(const ContactVector& x) const {
    NormalEquations<ContactParameters> out;
    for (Index i = 0; i < log_.depth.size(); ++i) {
      if (weight[i] == 0) continue;
      const ContactReading reading = read(x, i);
      out.add_huber(reading.derivatives, reading.residual, huber);
      if (reading.before > 0 && std::isfinite(reading.before))
        out.add_huber(-ContactVector::Unit(Position) / position_noise, reading.before, huber);
    }
    for (Index i = 0; i < ContactParameters; ++i)
      if (held[static_cast<std::size_t>(i)]) out.hold(i);
    return out;
  }

  const std::vector<RowRange>& runs() const { return runs_; }

 private:
  const ContactLog& log_;
  std::vector<RowRange> runs_;
  VectorXd speed_;
  std::vector<bool> receding_;

 public:
  VectorXd weight;  ///< 0 for a reading that is left out, else 1.
  std::array<bool, ContactParameters> held = {false, false, false, true, true, true};
  double position_noise;
  double force_noise = 1.0;
  double huber = 1e9;
};

/// The line through two readings that agrees best with all of them in the median, and the force before contact.
ContactVector robust_start(const ContactLog& log, const ContactStiffnessOptions& options) {
  const Index n = log.depth.size();
  std::vector<std::pair<double, double>> by_depth;
  for (Index i = 0; i < n; ++i) by_depth.emplace_back(log.depth[i], log.force[i]);
  std::sort(by_depth.begin(), by_depth.end());
  std::vector<double> shallow;
  for (Index i = 0; i < std::max<Index>(n / 10, 1); ++i)
    shallow.push_back(by_depth[static_cast<std::size_t>(i)].second);
  const double range = log.depth.maxCoeff() - log.depth.minCoeff();
  Random random(static_cast<std::uint64_t>(options.seed));
  ContactVector best = ContactVector::Zero();
  double least = std::numeric_limits<double>::infinity();
  constexpr int draws = 400;
  constexpr Index judged = 400;
  const Index stride = std::max<Index>(n / judged, 1);
  for (const double offset : {0.0, median(shallow)})
    for (int draw = 0; draw < draws; ++draw) {
      const Index a = random.integer(static_cast<int>(n)), b = random.integer(static_cast<int>(n));
      if (std::abs(log.depth[a] - log.depth[b]) < std::max(0.05 * range, 3 * options.position_noise)) continue;
      const double k = (log.force[a] - log.force[b]) / (log.depth[a] - log.depth[b]);
      if (!(k > 0)) continue;
      const double begin = log.depth[a] - (log.force[a] - offset) / k;
      std::vector<double> errors;
      double sum = 0.0;
      for (Index i = 0; i < n; i += stride) {
        errors.push_back(std::abs(log.force[i] - offset - std::max(k * (log.depth[i] - begin), 0.0)));
        sum += errors.back();
      }
      const double score = median(errors) + 0.1 * sum / static_cast<double>(errors.size());
      if (score >= least) continue;
      least = score;
      best[Stiffness] = k, best[Position] = begin, best[ForceOffset] = offset;
    }
  return best;
}

/// Force residuals of the readings in use at x [N], those in contact with the share of the depth's noise.
VectorXd whitened_residuals(const ContactProblem& problem, const ContactVector& x) {
  VectorXd out(problem.weight.size());
  for (Index i = 0; i < out.size(); ++i) out[i] = problem.weight[i] * problem.read(x, i).residual;
  return out;
}

double robust_scale(const VectorXd& values) {
  std::vector<double> sizes;
  for (const double v : values) sizes.push_back(std::abs(v));
  return mad_to_sigma * median(std::move(sizes));
}

/// Standard deviation of a force: as given, from the readings without contact, or what the noise of the depth leaves.
double force_noise_of(ContactProblem& problem, const ContactVector& x, const ContactStiffnessOptions& options) {
  if (options.force_noise > 0) return options.force_noise;
  problem.force_noise = 1.0;
  std::vector<double> before, all;
  const double position_noise = std::exchange(problem.position_noise, 0.0);
  for (Index i = 0; i < problem.weight.size(); ++i) {
    const ContactReading reading = problem.read(x, i);
    if (problem.weight[i] == 0) continue;
    all.push_back(std::abs(reading.residual));
    const bool clearly_before = problem.depth(i) < x[Position] - 3 * position_noise;
    if (clearly_before && !reading.contact) before.push_back(std::abs(reading.residual));
  }
  problem.position_noise = position_noise;
  constexpr std::size_t enough = 20;
  const double total = mad_to_sigma * median(all), least = 1e-6 * std::abs(x[Stiffness]) * position_noise + 1e-12;
  if (before.size() >= enough) return std::max(mad_to_sigma * median(before), least);
  const double of_depth = x[Stiffness] * position_noise;
  return std::max(std::sqrt(std::max(total * total - of_depth * of_depth, 0.01 * total * total)), least);
}

struct ContactFit {
  ContactVector x = ContactVector::Zero();
  ContactVector deviations = ContactVector::Zero();
  MatrixXd covariance = MatrixXd::Zero(ContactParameters, ContactParameters);
  double scale = 0.0;  ///< Standard deviation of a whitened residual [-].
  bool converged = false;
  int iterations = 0;
};

ContactFit fit_contact(const ContactProblem& problem, const ContactVector& start) {
  const auto found = levenberg_marquardt<ContactParameters>(start, problem, {.max_iterations = 100});
  ContactFit out{.x = found.x, .converged = found.usable(), .iterations = found.iterations};
  std::vector<Index> free;
  for (Index i = 0; i < ContactParameters; ++i)
    if (!problem.held[static_cast<std::size_t>(i)]) free.push_back(i);
  MatrixXd J = MatrixXd::Zero(problem.weight.size(), ContactParameters);
  for (Index i = 0; i < J.rows(); ++i) J.row(i) = problem.weight[i] * problem.read(out.x, i).derivatives.transpose();
  const auto covariance =
      correlated_covariance(J(Eigen::all, free), whitened_residuals(problem, out.x), problem.runs());
  out.scale = std::sqrt(covariance.variance);
  if (covariance.covariance.size() > 0) out.covariance(free, free) = covariance.covariance;
  out.deviations = out.covariance.diagonal().cwiseSqrt();
  return out;
}

/// Residual beyond which a reading is no part of a fit of so many parameters: as improbable, by Student's t, as
/// `normal` standard deviations of many residuals are. The scale of few residuals is itself uncertain, and too small.
double outlier_limit(const VectorXd& residuals, int parameters, double normal) {
  const double freedom = std::max(static_cast<double>(residuals.size()) - parameters, 1.0);
  const double widened = std::sqrt(static_cast<double>(residuals.size()) / freedom);
  const double scale = widened * std::max(robust_scale(residuals), 1e-9);
  return scale * uncertainty::student_factor(freedom, std::erf(normal / std::sqrt(2.0)));
}

/// Robust, then without what lies far off, twice: an outlier also hides others.
ContactFit fit_without_outliers(ContactProblem& problem, ContactVector x, const ContactStiffnessOptions& options) {
  constexpr double huber_limit = 1.5;
  ContactFit out;
  for (int round = 0; round < 3; ++round) {
    problem.force_noise = force_noise_of(problem, x, options);
    const double scale = std::max(robust_scale(whitened_residuals(problem, x)), 1e-9);
    problem.huber = huber_limit * scale;
    x = fit_contact(problem, x).x;
    problem.weight.setOnes();
    const VectorXd residuals = whitened_residuals(problem, x);
    const double limit =
        outlier_limit(residuals, static_cast<int>(std::count(problem.held.begin(), problem.held.end(), false)),
                      options.outlier_limit);
    for (Index i = 0; i < residuals.size(); ++i) problem.weight[i] = std::abs(residuals[i]) > limit ? 0.0 : 1.0;
    problem.huber = std::numeric_limits<double>::max();
    out = fit_contact(problem, x);
    x = out.x;
  }
  return out;
}

ContactStiffnessResult refused_contact(ContactStiffnessResult result, std::string message) {
  result.fit.status = FitStatus::Degenerate;
  result.fit.message = std::move(message);
  return result;
}

void count_readings(ContactStiffnessResult& out, const ContactProblem& problem, const ContactVector& x) {
  out.free_readings = out.contact_readings = 0;
  for (Index i = 0; i < problem.weight.size(); ++i)
    if (problem.weight[i] > 0) ++(problem.read(x, i).contact ? out.contact_readings : out.free_readings);
}

/// Adds a stiffness of the way out where the readings ask for one.
ContactFit with_way_out(ContactProblem& problem, const ContactFit& one, ContactStiffnessResult& out) {
  constexpr int fewest = 5;
  constexpr double clear = 3.3;  // standard deviations: 1 in 1000
  int in = 0, back = 0;
  for (Index i = 0; i < problem.weight.size(); ++i)
    if (problem.weight[i] > 0 && problem.read(one.x, i).contact) ++(problem.receding(i) ? back : in);
  if (in < fewest || back < fewest) return one;
  problem.held[Unloading] = false;
  const ContactFit two = fit_contact(problem, one.x);
  if (two.converged && std::abs(two.x[Unloading]) > clear * two.deviations[Unloading]) {
    out.unloading_stiffness = two.x[Stiffness] + two.x[Unloading];
    out.warnings.push_back("the way out has a stiffness of " + short_number(*out.unloading_stiffness) +
                           " N/m, the way in " + short_number(two.x[Stiffness]) + " N/m: the contact yields or rubs");
    return two;
  }
  problem.held[Unloading] = true;
  return one;
}

void add_contact_warnings(ContactStiffnessResult& out, const ContactProblem& problem, const ContactFit& found) {
  if (problem.held[ForceOffset])
    out.warnings.push_back(
        "no reading is before contact: the force offset is taken as 0, and the position of contact "
        "is as wrong as that");
  if (out.stiffness < 100 || out.stiffness > 1e9)
    out.warnings.push_back("a stiffness of " + short_number(out.stiffness) +
                           " N/m is unusual; are depths in m and forces in N?");
  if (problem.held[Hardening] && out.contact_readings > ContactParameters + 1) {
    ContactProblem curved = problem;
    curved.held[Hardening] = false;
    const ContactFit bent = fit_contact(curved, found.x);
    if (bent.converged && std::abs(bent.x[Hardening]) > 4 * bent.deviations[Hardening])
      out.warnings.push_back("the force is no straight line over the depth: the stiffness grows by " +
                             short_number(0.1 * bent.x[Hardening]) +
                             " % a millimetre; estimate the hardening (fit_hardening)");
  }
}

}  // namespace

ContactStiffnessResult identify_contact_stiffness(const ContactLog& log, const ContactStiffnessOptions& options) {
  options.validate();
  log.validate();
  require(!options.fit_damping || log.t.size() > 0, "fit_damping: needs the times of the readings, t [s]");
  ContactStiffnessResult out;
  constexpr Index fewest = 4;
  const Index n = log.depth.size();
  if (n < fewest) return refused_contact(out, "found " + std::to_string(n) + " readings, expected at least 4");
  const double range = log.depth.maxCoeff() - log.depth.minCoeff();
  if (!(range > 6 * options.position_noise))
    return refused_contact(out, "the depths lie within " + short_number(range) + " m: press to different depths");
  const VectorXd about = log.depth.array() - log.depth.mean();
  const double slope = about.dot(log.force) / about.squaredNorm();
  ContactVector x = robust_start(log, options);
  if (slope < 0 || !(x[Stiffness] > 0))
    return refused_contact(out,
                           "force falls with depth: the sign of one of the two is reversed, or nothing was touched");

  ContactProblem problem(log, runs_of(log.run_starts, n), options);
  count_readings(out, problem, x);
  constexpr int enough_free = 3;
  if (out.free_readings < enough_free) {
    problem.held[ForceOffset] = true;
    x[ForceOffset] = 0.0;
  }
  ContactFit found = fit_without_outliers(problem, x, options);
  found = with_way_out(problem, found, out);
  count_readings(out, problem, found.x);
  out.stiffness = found.x[Stiffness];
  out.position = found.x[Position];
  out.force_offset = found.x[ForceOffset];
  out.damping = found.x[Damping];
  out.hardening = found.x[Hardening];
  out.covariance = found.covariance;
  out.noise = found.scale * problem.force_noise;
  out.predicted = VectorXd::NullaryExpr(n, [&](Index i) { return problem.predicted(found.x, i); });
  for (Index i = 0; i < n; ++i)
    if (problem.weight[i] == 0) out.outliers.push_back(static_cast<int>(i));
  out.fit.iterations = found.iterations;
  out.fit.initial_rms = std::sqrt(whitened_residuals(problem, x).squaredNorm() / static_cast<double>(n));
  out.fit.final_rms = found.scale;
  const double relative = found.deviations[Stiffness] / out.stiffness;
  if (out.contact_readings < 3)
    return refused_contact(
        out, "found " + std::to_string(out.contact_readings) + " readings in contact, expected at least 3");
  if (!found.converged || !(relative > 0 || found.scale < 1e-6) || relative > options.accepted_std)
    return refused_contact(out, "the readings show no contact: stiffness known to " + short_number(100 * relative) +
                                    " %; press deeper, or read the force more often");
  if (static_cast<Index>(4 * out.outliers.size()) > n)
    return refused_contact(out, std::to_string(out.outliers.size()) + " of " + std::to_string(n) +
                                    " readings contradict the others: force and depth do not belong to one contact");
  add_contact_warnings(out, problem, found);
  out.fit.status = FitStatus::Converged;
  out.fit.message = "converged";
  return out;
}

}  // namespace kr5::identification
