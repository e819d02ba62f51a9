// SPDX-License-Identifier: BSD-3-Clause
#include "gap/fitting/start.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>

#include <kr5/cell/effect.hpp>
#include <kr5/gap/estimated_effect.hpp>

namespace kr5::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Part of a gap that slopes may miss where they tell it.
constexpr double missed_in_reach = 0.3;
/// Steps that refit what was fitted before, in about the same noise.
constexpr int refitting_steps = 4;
/// Loss of log evidence by slopes that is certain, however far they hold.
constexpr double certain_loss = 300.0;

/// The parameter of an effect of one coordinate, as the cell holds it.
double value_at(const cell::Cell& cell, const Hypothesis& h, const std::string& parameter, double x) {
  cell::Cell moved = cell;
  h.apply(moved, VectorXd::Constant(1, x));
  const auto value = cell::get_effect(moved.effects, h.effect, h.target, parameter);
  const auto* number = value ? std::get_if<double>(&*value) : nullptr;
  return number ? *number : std::nan("");
}

/// What becomes of a model when only some of its parts are kept, as far as its slopes tell.
class Reduction {
 public:
  Reduction(const FitProblem& problem, const Model& model)
      : problem_(problem), model_(model), kept_(model.parts.size(), true) {
    for (std::size_t p = 0; p < model.parts.size(); ++p) first_.push_back(model.first_coordinate(p));
    curvature_ = model.information + model.check_information;
    curvature_.diagonal().array() += 1.0 / (prior_width * prior_width);
    x_.resize(curvature_.rows());
    for (std::size_t p = 0; p < model.parts.size(); ++p)
      x_.segment(first_[p], model.parts[p].x.size()) = model.parts[p].x;
    evidence_ = evidence(kept_);
  }

  /// Takes away what pays least for itself, as long as anything does not.
  void reduce() {
    for (;;) {
      std::optional<std::size_t> worst;
      double best = evidence_;
      for (std::size_t p = 0; p < kept_.size(); ++p) {
        if (!kept_[p]) continue;
        std::vector<bool> fewer = kept_;
        fewer[p] = false;
        if (const double there = evidence(fewer); there > best) best = there, worst = p;
      }
      if (!worst) return;
      kept_[*worst] = false;
      evidence_ = best;
    }
  }

  void leave_out(std::size_t part) { kept_[part] = false; }

  /// The model of what is kept, by the slopes.
  Model linear() const {
    const FitProblem& problem = problem_;
    const VectorXd moved = values(kept_) - x_;
    const std::vector<Index> in = coordinates(kept_, true);
    Model out;
    out.parts = parts();
    out.residual = model_.residual;
    for (Index i = 0; i < moved.size(); ++i) add_slope(problem.data, -moved(i), model_, i, out.residual);
    for (const Index i : in) {
      out.jacobian.push_back(model_.jacobian[static_cast<std::size_t>(i)]);
      out.check_jacobian.push_back(model_.check_jacobian[static_cast<std::size_t>(i)]);
    }
    out.information = model_.information(in, in);
    const VectorXd counted = counted_residual(problem.data, out.residual);
    out.chi2_fit = sum_of(problem.data, counted, cell::Split::Fit).chi2;
    predict_check(problem, out);
    return out;
  }

  /// What is kept, at the values that it takes then.
  std::vector<Part> parts() const {
    const VectorXd x = values(kept_);
    std::vector<Part> out;
    for (std::size_t p = 0; p < kept_.size(); ++p)
      if (kept_[p]) out.push_back({model_.parts[p].candidate, x.segment(first_[p], model_.parts[p].x.size())});
    return out;
  }

 private:
  std::vector<Index> coordinates(const std::vector<bool>& kept, bool of_kept) const {
    std::vector<Index> out;
    for (std::size_t p = 0; p < kept.size(); ++p)
      for (Index i = 0; kept[p] == of_kept && i < model_.parts[p].x.size(); ++i) out.push_back(first_[p] + i);
    return out;
  }

  /// Values of all coordinates; 0 of what is not kept, for which the others make up.
  VectorXd values(const std::vector<bool>& kept) const {
    const std::vector<Index> in = coordinates(kept, true), out = coordinates(kept, false);
    VectorXd x = x_;
    x(out).setZero();
    if (!in.empty() && !out.empty())
      x(in) += MatrixXd(curvature_(in, in)).ldlt().solve(MatrixXd(curvature_(in, out)) * x_(out));
    return x;
  }

  double evidence(const std::vector<bool>& kept) const {
    const std::vector<Index> in = coordinates(kept, true);
    const VectorXd x = values(kept), moved = x - x_;
    double out = -0.5 * moved.dot(curvature_ * moved);
    if (!in.empty())
      out -= 0.5 *
             (prior_width * prior_width * MatrixXd(curvature_(in, in)).ldlt().vectorD().array().max(1e-12)).log().sum();
    for (std::size_t p = 0; p < kept.size(); ++p) {
      if (!kept[p]) continue;
      out += problem_.log_prior_effect + model_.parts[p].candidate->hypothesis.log_prior;
      out -= (x.segment(first_[p], model_.parts[p].x.size()).array() / prior_width).square().log1p().sum();
    }
    return out;
  }

  const FitProblem& problem_;
  const Model& model_;
  std::vector<Index> first_;
  MatrixXd curvature_;
  VectorXd x_;
  std::vector<bool> kept_;
  double evidence_ = 0.0;
};

}  // namespace

cell::Cell cell_with(const cell::Cell& cell, const std::vector<FittedEffect>& effects) {
  cell::Cell out = cell;
  for (const FittedEffect& e : effects) set_estimates(out, e, e.parameters);
  return out;
}

bool is_of(const FittedEffect& fitted, const Hypothesis& h) { return fitted == h && h.size() == 1; }

std::optional<double> coordinate_at(const cell::Cell& cell, const Hypothesis& h, double value) {
  const std::string& parameter = cell::find_effect(h.effect).parameters.front().name;
  const Coordinate& c = h.coordinates.front();
  const auto below = [&](double x) { return value_at(cell, h, parameter, x) < value; };
  constexpr double near = 1e-6;  // beside a bound at which an effect is off and has no value
  const double middle = std::clamp(near, c.lower, c.upper);
  const bool rising = value_at(cell, h, parameter, std::min(middle + 0.1, c.upper)) >=
                      value_at(cell, h, parameter, std::max(middle, c.lower));
  const bool upwards = below(middle) == rising;
  double inner = middle, outer = middle, reach = 1.0;
  do {  // until the value lies between
    inner = outer;
    outer = std::clamp(middle + (upwards ? reach : -reach), c.lower, c.upper);
    reach *= 2.0;
    if (outer == inner)
      return std::abs(value_at(cell, h, parameter, outer) - value) <= 1e-9 * (1.0 + std::abs(value))
                 ? std::optional(outer)
                 : std::nullopt;
  } while (below(outer) == below(middle));
  for (int k = 0; k < 60; ++k) {
    const double x = 0.5 * (inner + outer);
    (below(x) == below(middle) ? inner : outer) = x;
  }
  return 0.5 * (inner + outer);
}

Model fit_start(const FitProblem& problem, const VectorXd& base, const std::vector<FittedEffect>& effects,
                const std::vector<std::shared_ptr<const Candidate>>& candidates, int threads) {
  std::vector<Part> parts;
  for (const FittedEffect& e : effects)
    for (const auto& candidate : candidates) {
      const Hypothesis& h = candidate->hypothesis;
      if (!is_of(e, h)) continue;
      const auto x = coordinate_at(problem.data.recording->cell, h, e.parameters.front().value.front());
      if (x) parts.push_back({candidate.get(), VectorXd::Constant(1, *x)});
      break;
    }
  Model from;
  from.residual = base;
  return fit(problem, from, std::move(parts), {.max_iterations = refitting_steps, .threads = threads});
}

bool in_reach(const ComparisonData& data, const Model& start, const VectorXd& base) {
  const VectorXd nominal = counted_residual(data, base), there = counted_residual(data, start.residual);
  VectorXd missed = nominal - there;
  Index i = 0;
  for (const Part& part : start.parts)
    for (Index k = 0; k < part.x.size(); ++k, ++i) add_slope(data, -part.x(k), start, i, missed);
  return missed.norm() <= missed_in_reach * (nominal - there).norm();
}

Model linear_without(const FitProblem& problem, const Model& model, std::size_t part) {
  Reduction reduction(problem, model);
  reduction.leave_out(part);
  return reduction.linear();
}

bool surely_worse(const Model& linear, const Model& than) {
  return linear.log_evidence < than.log_evidence - certain_loss;
}

Model without_idle(const FitProblem& problem, const VectorXd& base, const Model& model, int threads) {
  Reduction reduction(problem, model);
  reduction.reduce();
  std::vector<Part> parts = reduction.parts();
  if (parts.size() == model.parts.size()) return model;
  if (parts.empty()) return empty_model(problem, base);
  Model from;
  from.residual = base;
  return fit(problem, from, std::move(parts), {.threads = threads, .near = &model});
}

}  // namespace kr5::gap
