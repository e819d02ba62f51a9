// SPDX-License-Identifier: BSD-3-Clause
#include "gap/fitting/fit.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <Eigen/Cholesky>

#include <kr5/core/levenberg_marquardt.hpp>

#include "gap/parallel.hpp"

namespace kr5::gap {
namespace {

/// The fit experiments that any part touches.
std::vector<int> touched(const ComparisonData& data, const std::vector<Part>& parts, cell::Split split) {
  std::set<int> all;
  for (const Part& part : parts)
    for (const int e : experiments_of_split(data, part.candidate->experiments, split)) all.insert(e);
  return {all.begin(), all.end()};
}

/// Position of a coordinate: its part and the index in it.
struct At {
  std::size_t part;
  Eigen::Index index;
};

/// What a coordinate changes in the prediction of a split, about the present point.
Signature slope(const ComparisonData& data, std::vector<Part> parts, const At& at, cell::Split split,
                const Eigen::VectorXd& residual) {
  const Candidate& candidate = *parts[at.part].candidate;
  const Coordinate& c = candidate.hypothesis.coordinates[static_cast<std::size_t>(at.index)];
  double& x = parts[at.part].x(at.index);
  const double step = x + c.step <= c.upper ? c.step : -c.step;
  x += step;
  const std::vector<int> own = experiments_of_split(data, candidate.experiments, split);
  return difference(data, own, residual, residuals(data, setup_of(data, parts), own, residual), 1 / step);
}

class Minimiser {
 public:
  Minimiser(const FitProblem& problem, const Model& from, std::vector<Part> parts, const FitOptions& options)
      : problem_(problem),
        options_(options),
        parts_(std::move(parts)),
        touched_(touched(problem.data, parts_, cell::Split::Fit)) {
    for (std::size_t p = 0; p < parts_.size(); ++p)
      for (Eigen::Index i = 0; i < parts_[p].x.size(); ++i) at_.push_back({p, i});
    clamp(parts_);
    residual_ = evaluate(parts_, touched_, from.residual);
    chi2_ = chi2(residual_);
  }

  void run() {
    scan_whole(12);
    linearise();
    // A step that gains less than a fiftieth of what one random number is worth ends the fit.
    LevenbergMarquardt<Eigen::Dynamic> optimizer({.max_iterations = options_.max_iterations,
                                                  .tolerance = std::sqrt(0.02),
                                                  .sigma = 1.0,
                                                  .initial_damping = 1e-3});
    optimizer.begin(normal_equations());
    while (optimizer.running()) {
      std::vector<Part> moved = parts_;
      for (std::size_t i = 0; i < at_.size(); ++i)
        moved[at_[i].part].x(at_[i].index) += optimizer.step()(static_cast<Eigen::Index>(i));
      clamp(moved);
      Eigen::VectorXd trial = evaluate(moved, touched_, residual_);
      const double value = chi2(trial);
      if (!optimizer.accept(value)) continue;
      keep(std::move(moved), std::move(trial), value);
      if (!optimizer.running()) break;
      linearise();
      optimizer.update(normal_equations());
    }
    scan_whole(2);
    linearise();
  }

  Model result() && {
    Model out;
    out.parts = std::move(parts_);
    out.residual = std::move(residual_);
    out.jacobian = std::move(jacobian_);
    out.information = std::move(information_);
    out.chi2_fit = chi2_;
    return out;
  }

 private:
  const Coordinate& coordinate(const At& at) const {
    return parts_[at.part].candidate->hypothesis.coordinates[static_cast<std::size_t>(at.index)];
  }
  bool whole(const At& at) const { return coordinate(at).whole; }

  void clamp(std::vector<Part>& parts) const {
    for (const At& at : at_) {
      double& x = parts[at.part].x(at.index);
      x = std::clamp(x, coordinate(at).lower, coordinate(at).upper);
      if (whole(at)) x = std::round(x);
    }
  }

  Eigen::VectorXd evaluate(const std::vector<Part>& parts, const std::vector<int>& experiments,
                           const Eigen::VectorXd& base) const {
    return residuals(problem_.data, setup_of(problem_.data, parts), experiments, base);
  }

  double chi2(const Eigen::VectorXd& residual) const {
    const Eigen::VectorXd r = counted_residual(problem_.data, residual);
    double out = sum_of(problem_.data, r, cell::Split::Fit).chi2;
    if (problem_.prior.size() > 0) {
      const Eigen::VectorXd b = project(problem_.data, problem_.nuisance, r);
      out -= problem_.prior.inner(b, b)(0, 0);
    }
    return out;
  }

  /// Signatures at the present point, and the normal equations with the nuisance parameters marginalised.
  void linearise() {
    jacobian_.resize(at_.size());
    parallel_for(static_cast<int>(at_.size()), options_.threads,
                 [&](int i) { jacobian_[i] = slope(problem_.data, parts_, at_[i], cell::Split::Fit, residual_); });
    const Eigen::VectorXd r = counted_residual(problem_.data, residual_);
    information_ = gram(jacobian_, jacobian_);
    gradient_.resize(static_cast<Eigen::Index>(jacobian_.size()));
    for (Eigen::Index i = 0; i < gradient_.size(); ++i) gradient_(i) = dot(problem_.data, jacobian_[i], r);
    if (problem_.prior.size() > 0) {
      const Eigen::MatrixXd a = project(problem_.nuisance, jacobian_);
      information_ -= problem_.prior.inner(a, a);
      gradient_ -= problem_.prior.inner(a, project(problem_.data, problem_.nuisance, r));
    }
  }

  /// Coordinates that a bound holds, and whole ones, stay.
  bool held(Eigen::Index i) const {
    const At& at = at_[static_cast<std::size_t>(i)];
    const double x = parts_[at.part].x(at.index);
    const Coordinate& c = coordinate(at);
    return c.whole || (x <= c.lower && gradient_(i) < 0) || (x >= c.upper && gradient_(i) > 0);
  }

  /// Those of the coordinates that are not held.
  NormalEquations<Eigen::Dynamic> normal_equations() const {
    NormalEquations<Eigen::Dynamic> out(gradient_.size());
    out.information = information_;
    out.gradient = -gradient_;
    out.cost = chi2_;
    for (Eigen::Index i = 0; i < gradient_.size(); ++i)
      if (held(i)) out.hold(i);
    return out;
  }

  void keep(std::vector<Part> parts, Eigen::VectorXd residual, double value) {
    parts_ = std::move(parts);
    residual_ = std::move(residual);
    chi2_ = value;
  }

  void keep_if_better(std::vector<Part> moved) {
    Eigen::VectorXd trial = evaluate(moved, touched_, residual_);
    const double value = chi2(trial);
    if (value < chi2_) keep(std::move(moved), std::move(trial), value);
  }

  /// Whole coordinates have no slope: all values near the present one are tried.
  void scan_whole(int reach) {
    for (const At& at : at_) {
      if (!whole(at)) continue;
      const double centre = parts_[at.part].x(at.index);
      for (int k = -reach; k <= reach; ++k) {
        std::vector<Part> moved = parts_;
        moved[at.part].x(at.index) = centre + k;
        clamp(moved);
        if (moved[at.part].x(at.index) != parts_[at.part].x(at.index)) keep_if_better(std::move(moved));
      }
    }
  }

  const FitProblem& problem_;
  const FitOptions& options_;
  std::vector<Part> parts_;
  std::vector<int> touched_;
  std::vector<At> at_;
  Eigen::VectorXd residual_;
  double chi2_ = 0.0;
  std::vector<Signature> jacobian_;
  Eigen::MatrixXd information_;
  Eigen::VectorXd gradient_;
};

Eigen::VectorXd check_rest(const FitProblem& problem, const Eigen::VectorXd& residual) {
  return without_nuisance(problem.data, problem.nuisance, problem.prior, counted_residual(problem.data, residual));
}

/// How the check experiments would move the coordinates, given what the fit and the prior know of them; those at a
/// bound, and whole ones, stay.
Eigen::VectorXd update_of(const Model& model, const Eigen::VectorXd& gradient) {
  const Eigen::Index n = gradient.size();
  Eigen::MatrixXd A = model.information + model.check_information;
  A.diagonal().array() += 1 / (prior_width * prior_width);
  Eigen::VectorXd g = gradient;
  Eigen::Index i = 0;
  for (const Part& part : model.parts)
    for (Eigen::Index k = 0; k < part.x.size(); ++k, ++i) {
      const Coordinate& c = part.candidate->hypothesis.coordinates[static_cast<std::size_t>(k)];
      if (!c.whole && part.x(k) > c.lower && part.x(k) < c.upper) continue;
      A.row(i).setZero();
      A.col(i).setZero();
      A(i, i) = 1.0;
      g(i) = 0.0;
    }
  return n > 0 ? Eigen::VectorXd(A.ldlt().solve(g)) : g;
}

/// The check experiments as the fit predicts them, with its uncertainty.
void predict_check(const FitProblem& problem, Model& model) {
  for (std::size_t p = 0; p < model.parts.size(); ++p)
    for (Eigen::Index i = 0; i < model.parts[p].x.size(); ++i)
      model.check_jacobian.push_back(slope(problem.data, model.parts, {p, i}, cell::Split::Check, model.residual));
  const Eigen::VectorXd r = check_rest(problem, model.residual);
  model.check_information = gram(model.check_jacobian, model.check_jacobian);
  Eigen::VectorXd gradient(static_cast<Eigen::Index>(model.check_jacobian.size()));
  for (Eigen::Index i = 0; i < gradient.size(); ++i) gradient(i) = dot(problem.data, model.check_jacobian[i], r);
  model.update = update_of(model, gradient);
  model.chi2_check = sum_of(problem.data, r, cell::Split::Check).chi2 - gradient.dot(model.update);
}

}  // namespace

Setup setup_of(const ComparisonData& data, const std::vector<Part>& parts) {
  Setup out = data.recording->cell;
  for (const Part& part : parts) apply(out, part.candidate->hypothesis, part.x);
  return out;
}

std::vector<Part> without(std::vector<Part> parts, std::size_t part) {
  parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(part));
  return parts;
}

bool same_effects(const std::vector<Part>& a, const std::vector<Part>& b) {
  return std::is_permutation(a.begin(), a.end(), b.begin(), b.end(),
                             [](const Part& p, const Part& q) { return p.candidate == q.candidate; });
}

Model empty_model(const FitProblem& problem, const Eigen::VectorXd& base) {
  Model out;
  out.residual = base;
  const Eigen::VectorXd r = counted_residual(problem.data, base);
  out.chi2_fit = sum_of(problem.data, r, cell::Split::Fit).chi2;
  if (problem.prior.size() > 0) {
    const Eigen::VectorXd b = project(problem.data, problem.nuisance, r);
    out.chi2_fit -= problem.prior.inner(b, b)(0, 0);
  }
  out.chi2_check = sum_of(problem.data, check_rest(problem, base), cell::Split::Check).chi2;
  out.log_evidence = log_evidence(problem, out);
  return out;
}

Model fit(const FitProblem& problem, const Model& from, std::vector<Part> parts, const FitOptions& options) {
  Minimiser minimiser(problem, from, std::move(parts), options);
  minimiser.run();
  Model out = std::move(minimiser).result();
  out.residual = residuals(problem.data, setup_of(problem.data, out.parts),
                           touched(problem.data, out.parts, cell::Split::Check), out.residual);
  predict_check(problem, out);
  out.log_evidence = log_evidence(problem, out);
  return out;
}

Eigen::VectorXd updated(const FitProblem& problem, const Model& model) {
  Eigen::VectorXd out = check_rest(problem, model.residual);
  for (Eigen::Index i = 0; i < model.update.size(); ++i) {
    add(problem.data, -model.update(i), model.jacobian[i], out);
    add(problem.data, -model.update(i), model.check_jacobian[i], out);
  }
  return out;
}

double log_evidence(const FitProblem& problem, const Model& model) {
  double out = -0.5 * (model.chi2_fit + model.chi2_check + problem.prior.log_det());
  if (model.parts.empty()) return out;
  const Eigen::MatrixXd scaled = Eigen::MatrixXd::Identity(model.information.rows(), model.information.cols()) +
                                 prior_width * prior_width * (model.information + model.check_information);
  out -= 0.5 * scaled.ldlt().vectorD().array().max(1e-12).log().sum();
  for (const Part& part : model.parts) {
    out += problem.log_prior_effect + part.candidate->hypothesis.log_prior;
    for (Eigen::Index i = 0; i < part.x.size(); ++i)
      if (!part.candidate->hypothesis.coordinates[static_cast<std::size_t>(i)].shape)
        out -= std::log1p(part.x(i) * part.x(i) / (prior_width * prior_width));
  }
  return out;
}

}  // namespace kr5::gap
