// SPDX-License-Identifier: BSD-3-Clause
#include "gap/fitting/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <Eigen/Cholesky>

#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/core/parallel.hpp>

namespace kr5::gap {
namespace {

/// Step of finite differences of a coordinate that is large, over the coordinate.
constexpr double relative_step = 1e-3;
/// Steps of slopes that are followed, over those of others, and to both sides: of stiffness, damping, friction and
/// inertia of a joint, all by one factor, the slopes nearly cancel, and what an error of them leaves counts as
/// information.
constexpr double fine_step = 0.1;

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

std::vector<At> coordinates_of(const std::vector<Part>& parts) {
  std::vector<At> out;
  for (std::size_t p = 0; p < parts.size(); ++p)
    for (Eigen::Index i = 0; i < parts[p].x.size(); ++i) out.push_back({p, i});
  return out;
}

/// Residuals at a point; nothing where there is no such cell.
std::optional<Eigen::VectorXd> residuals_at(const ComparisonData& data, const std::vector<Part>& parts,
                                            const std::vector<int>& experiments, const Eigen::VectorXd& base) {
  return where_possible([&] { return residuals(data, setup_of(data, parts), experiments, base); });
}

/// Of the changes to both sides their mean; of a sample in which they differ by more than that, the smaller one: the
/// other crossed an instant at which a joint came to rest.
Eigen::VectorXd slope_of_sides(const Eigen::VectorXd& forward, const Eigen::VectorXd& backward) {
  const Eigen::ArrayXd f = forward.array(), b = backward.array();
  const Eigen::ArrayXd smaller = (f.abs() < b.abs()).select(f, b);
  return ((f - b).abs() > (f + b).abs()).select(smaller, 0.5 * (f + b));
}

/// Whether slopes are those of steps to both sides.
bool two_sided(const FitProblem& problem, const Coordinate& c) {
  return problem.slopes == Slopes::WhereNeeded && !c.whole;
}

/// Steps of a coordinate for its slope, within its bounds: to both sides, or to one of them.
std::vector<double> slope_steps(const FitProblem& problem, const std::vector<Part>& parts, const At& at) {
  const Coordinate& c = parts[at.part].candidate->hypothesis.coordinates[static_cast<std::size_t>(at.index)];
  const double x = parts[at.part].x(at.index);
  const bool both = two_sided(problem, c);
  const double size = (both ? fine_step : 1.0) * std::max(c.step, relative_step * std::abs(x));
  std::vector<double> out;
  for (const double step : {size, -size})
    if (x + step <= c.upper && (!both || x + step >= c.lower)) out.push_back(step);
  return out;
}

/// What steps change, each over its step, as one slope.
Signature slope_of(const ComparisonData& data, const std::vector<int>& experiments,
                   const std::vector<Eigen::VectorXd>& sides, const Eigen::VectorXd& residual) {
  if (sides.empty()) return {};
  const Eigen::VectorXd slope = sides.size() == 2 ? slope_of_sides(sides[0], sides[1]) : sides[0];
  return difference(data, experiments, residual, residual - slope);
}

/// What a coordinate changes in the prediction of a split, about the present point.
Signature slope(const FitProblem& problem, const std::vector<Part>& parts, const At& at, cell::Split split,
                const Eigen::VectorXd& residual) {
  const Candidate& candidate = *parts[at.part].candidate;
  const std::vector<int> own = experiments_of_split(problem.data, candidate.experiments, split);
  std::vector<Eigen::VectorXd> sides;
  for (const double step : slope_steps(problem, parts, at)) {
    std::vector<Part> moved = parts;
    moved[at.part].x(at.index) += step;
    if (const std::optional<Eigen::VectorXd> there = residuals_at(problem.data, moved, own, residual))
      sides.emplace_back((residual - *there) / step);
    const Coordinate& c = candidate.hypothesis.coordinates[static_cast<std::size_t>(at.index)];
    if (!two_sided(problem, c) && !sides.empty()) break;
  }
  return slope_of(problem.data, own, sides, residual);
}

/// Coordinates of the same effect on different targets, each of which has columns of its own: numbers among `at`.
std::vector<std::vector<int>> alike(const ComparisonData& data, const std::vector<Part>& parts,
                                    const std::vector<At>& at) {
  const auto has_columns = [&](const std::string& target) {
    return std::ranges::any_of(data.blocks, [&](const Block& b) { return b.target == target; });
  };
  std::map<std::pair<std::string, Eigen::Index>, std::vector<int>> groups;
  std::vector<std::vector<int>> out;
  for (int i = 0; i < static_cast<int>(at.size()); ++i) {
    const Hypothesis& h = parts[at[i].part].candidate->hypothesis;
    const bool own = has_columns(h.target) && !h.coordinates[static_cast<std::size_t>(at[i].index)].whole;
    if (own)
      groups[{h.effect, at[i].index}].push_back(i);
    else
      out.push_back({i});
  }
  for (auto& [effect, group] : groups) out.push_back(std::move(group));
  return out;
}

/// Slopes of coordinates that are moved together, each as what changes in the columns of its own target: a joint hardly
/// moves by the servo of another. Nothing where there is no such cell.
std::vector<Signature> shared_slopes(const FitProblem& problem, const std::vector<Part>& parts,
                                     const std::vector<At>& group, const Eigen::VectorXd& residual) {
  const ComparisonData& data = problem.data;
  const std::vector<int> experiments = touched(data, parts, cell::Split::Fit);
  std::vector<std::vector<Eigen::VectorXd>> sides(group.size());
  for (const double side : {1.0, -1.0}) {
    std::vector<Part> moved = parts;
    std::vector<double> steps(group.size(), 0.0);
    for (std::size_t k = 0; k < group.size(); ++k) {
      for (const double step : slope_steps(problem, parts, group[k]))
        if (step * side > 0.0) steps[k] = step;
      moved[group[k].part].x(group[k].index) += steps[k];
    }
    const std::optional<Eigen::VectorXd> there = residuals_at(data, moved, experiments, residual);
    if (!there) return {};
    for (std::size_t k = 0; k < group.size(); ++k)
      if (steps[k] != 0.0) sides[k].emplace_back((residual - *there) / steps[k]);
  }
  std::vector<Signature> out;
  for (std::size_t k = 0; k < group.size(); ++k) {
    const std::string& target = parts[group[k].part].candidate->hypothesis.target;
    out.push_back(slope_of(data, experiments, sides[k], residual));
    const auto of_other = [&](const auto& part) { return data.blocks[part.first].target != target; };
    std::erase_if(out.back().parts, of_other);
  }
  return out;
}

/// Slopes of coordinates; nothing for one whose slope is not known.
using GivenSlopes = std::vector<std::optional<Signature>>;

/// The slopes that a model has of the coordinates of other parts.
GivenSlopes kept_slopes(const Model& from, const std::vector<Signature>& slopes, const std::vector<Part>& parts) {
  const std::vector<At> known = slopes.empty() ? std::vector<At>{} : coordinates_of(from.parts);
  GivenSlopes out;
  for (const At& at : coordinates_of(parts)) {
    const auto same = [&](const At& k) {
      return from.parts[k.part].candidate == parts[at.part].candidate && k.index == at.index;
    };
    const auto found = std::ranges::find_if(known, same);
    out.push_back(found == known.end() ? std::nullopt
                                       : std::optional(slopes[static_cast<std::size_t>(found - known.begin())]));
  }
  return out;
}

/// Slopes of all coordinates, but those that are there already.
std::vector<Signature> slopes(const FitProblem& problem, const std::vector<Part>& parts, cell::Split split,
                              const Eigen::VectorXd& residual, GivenSlopes kept, int threads) {
  const std::vector<At> at = coordinates_of(parts);
  kept.resize(at.size());
  std::vector<Signature> out(at.size());
  parallel_for(static_cast<int>(at.size()), threads,
               [&](int i) { out[i] = kept[i] ? std::move(*kept[i]) : slope(problem, parts, at[i], split, residual); });
  return out;
}

/// Slopes of all coordinates on the fit experiments, those of the same effect on different targets shared.
std::vector<Signature> shared_slopes(const FitProblem& problem, const std::vector<Part>& parts,
                                     const Eigen::VectorXd& residual, int threads) {
  const std::vector<At> at = coordinates_of(parts);
  const std::vector<std::vector<int>> groups = alike(problem.data, parts, at);
  std::vector<Signature> out(at.size());
  parallel_for(static_cast<int>(groups.size()), threads, [&](int g) {
    const std::vector<int>& group = groups[g];
    std::vector<At> of_group;
    for (const int i : group) of_group.push_back(at[i]);
    std::vector<Signature> found;
    if (group.size() > 1) found = shared_slopes(problem, parts, of_group, residual);
    for (std::size_t k = 0; k < group.size(); ++k)
      out[group[k]] =
          found.empty() ? slope(problem, parts, of_group[k], cell::Split::Fit, residual) : std::move(found[k]);
  });
  return out;
}

class Minimiser {
 public:
  Minimiser(const FitProblem& problem, const Model& from, std::vector<Part> parts, const FitOptions& options)
      : problem_(problem),
        options_(options),
        parts_(std::move(parts)),
        touched_(touched(problem.data, parts_, cell::Split::Fit)),
        at_(coordinates_of(parts_)) {
    clamp(parts_);
    residual_ = begin(from.residual);
    chi2_ = cost(parts_, residual_);
  }

  void run() {
    scan_whole(12);
    if (kept())
      linearise(kept_slopes(*options_.near, options_.near->jacobian, parts_));
    else
      renew_slopes();
    LevenbergMarquardtOptions how{
        .max_iterations = kept() ? std::min(most_steps_kept, options_.max_iterations) : options_.max_iterations,
        .tolerance = std::sqrt(options_.least_gain),
        .sigma = 1.0,
        .initial_damping = 1e-3};
    for (int round = 0; round < most_rounds; ++round) {
      Optimizer optimizer(how);
      optimizer.begin(normal_equations());
      while (optimizer.running()) take_step(optimizer);
      how.max_iterations -= optimizer.iterations();
      if (!followed() || kept() || slopes_ == Known::Here || how.max_iterations <= 0) break;
      linearise();
      how.initial_damping = along_valleys;
    }
    scan_whole(2);
    if (!kept() && slopes_ != Known::Here) linearise();
    sum_up();
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
  using Optimizer = LevenbergMarquardt<Eigen::Dynamic>;

  /// Where slopes were simulated.
  enum class Known {
    Before,     ///< At another point, from which they followed the steps.
    HereAbout,  ///< At the present point, shared by targets.
    Here,
  };

  /// Times that the slopes are simulated because the steps by those before led no further, at most.
  static constexpr int most_rounds = 8;
  static constexpr int most_halved = 12;
  /// Damping with which a fit goes on, which is small beside the least curvature of what the data tell.
  static constexpr double along_valleys = 1e-9;
  /// Steps by slopes of a model nearby: where these do not lead, the fit is not near.
  static constexpr int most_steps_kept = 3;

  const Coordinate& coordinate(const At& at) const {
    return parts_[at.part].candidate->hypothesis.coordinates[static_cast<std::size_t>(at.index)];
  }
  bool whole(const At& at) const { return coordinate(at).whole; }
  bool followed() const { return problem_.slopes == Slopes::WhereNeeded; }
  bool kept() const { return followed() && options_.near; }

  void clamp(std::vector<Part>& parts) const {
    for (const At& at : at_) {
      double& x = parts[at.part].x(at.index);
      x = std::clamp(x, coordinate(at).lower, coordinate(at).upper);
      if (whole(at)) x = std::round(x);
    }
  }

  /// Residuals where the fit begins. Where there is no such cell, the last effect, by which the others are extended,
  /// begins nearer to where it is off.
  Eigen::VectorXd begin(const Eigen::VectorXd& base) {
    for (int halved = 0; halved < most_halved && !parts_.empty(); ++halved) {
      if (auto there = residuals_at(problem_.data, parts_, touched_, base)) return std::move(*there);
      parts_.back().x *= 0.5;
      clamp(parts_);
    }
    return residuals(problem_.data, setup_of(problem_.data, parts_), touched_, base);
  }

  /// Tries the step of the optimizer.
  void take_step(Optimizer& optimizer) {
    std::vector<Part> moved = parts_;
    for (std::size_t i = 0; i < at_.size(); ++i)
      moved[at_[i].part].x(at_[i].index) += optimizer.step()(static_cast<Eigen::Index>(i));
    clamp(moved);
    std::optional<Eigen::VectorXd> trial = residuals_at(problem_.data, moved, touched_, residual_);
    const double value = trial ? cost(moved, *trial) : std::numeric_limits<double>::infinity();
    if (!optimizer.accept(value)) {
      if (!optimizer.running() || slopes_ == Known::Here || kept()) return;
      renew_slopes();
    } else {
      if (followed()) follow(moved, *trial);
      keep(std::move(moved), std::move(*trial), value);
      if (!optimizer.running()) return;
      if (!followed()) linearise();
    }
    optimizer.update(normal_equations());
  }

  /// Slopes that give what a step changed, and differ as little as that allows from those before (Broyden 1965), each
  /// in the unit of what it changes.
  void follow(const std::vector<Part>& moved, const Eigen::VectorXd& trial) {
    Eigen::VectorXd step(gradient_.size());
    for (Eigen::Index i = 0; i < step.size(); ++i) {
      const At& at = at_[static_cast<std::size_t>(i)];
      step(i) = moved[at.part].x(at.index) - parts_[at.part].x(at.index);
    }
    const Eigen::VectorXd weighted = information_.diagonal().cwiseProduct(step);
    const double square = weighted.dot(step);
    if (!(square > 0.0)) return;
    const Eigen::ArrayXd moves = (residual_ - trial).array();
    Eigen::VectorXd missed = moves.isNaN().select(0.0, moves) * problem_.data.use;
    for (Eigen::Index i = 0; i < step.size(); ++i)
      add(problem_.data, -step(i), jacobian_[static_cast<std::size_t>(i)], missed);
    for (Eigen::Index i = 0; i < step.size(); ++i)
      if (weighted(i) != 0.0)
        add(problem_.data, weighted(i) / square, missed, touched_, jacobian_[static_cast<std::size_t>(i)]);
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

  double cost(const std::vector<Part>& parts, const Eigen::VectorXd& residual) const {
    double out = chi2(residual);
    for (const Part& part : parts) out += weight() * part.x.squaredNorm();
    return out;
  }

  /// Of the prior of a coordinate.
  double weight() const { return problem_.width > 0.0 ? 1.0 / (problem_.width * problem_.width) : 0.0; }

  /// Slopes at the present point, which are shared before each is simulated.
  void renew_slopes() {
    if (followed() && slopes_ == Known::Before)
      linearise_shared();
    else
      linearise();
  }

  /// Slopes at the present point, but those that are given.
  void linearise(GivenSlopes given = {}) {
    const bool any_given = std::ranges::any_of(given, [](const auto& slope) { return slope.has_value(); });
    slopes_ = any_given ? Known::Before : Known::Here;
    jacobian_ = slopes(problem_, parts_, cell::Split::Fit, residual_, std::move(given), options_.threads);
  }

  /// Slopes at the present point, about.
  void linearise_shared() {
    slopes_ = Known::HereAbout;
    jacobian_ = shared_slopes(problem_, parts_, residual_, options_.threads);
  }

  /// Information and gradient by the present slopes, the nuisance parameters marginalised.
  void sum_up() {
    const Eigen::VectorXd r = counted_residual(problem_.data, residual_);
    information_ = gram(jacobian_, jacobian_);
    gradient_.resize(static_cast<Eigen::Index>(jacobian_.size()));
    for (Eigen::Index i = 0; i < gradient_.size(); ++i) gradient_(i) = dot(problem_.data, jacobian_[i], r);
    if (problem_.width > 0.0) {
      information_.diagonal().array() += weight();
      for (Eigen::Index i = 0; i < gradient_.size(); ++i) {
        const At& at = at_[static_cast<std::size_t>(i)];
        gradient_(i) -= weight() * parts_[at.part].x(at.index);
      }
    }
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
  NormalEquations<Eigen::Dynamic> normal_equations() {
    sum_up();
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
    slopes_ = Known::Before;
  }

  void keep_if_better(std::vector<Part> moved) {
    std::optional<Eigen::VectorXd> trial = residuals_at(problem_.data, moved, touched_, residual_);
    const double value = trial ? cost(moved, *trial) : chi2_;
    if (value < chi2_) keep(std::move(moved), std::move(*trial), value);
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
  Known slopes_ = Known::Before;
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

/// Slopes on the check experiments.
std::vector<Signature> check_slopes(const FitProblem& problem, const FitOptions& options, const Model& model) {
  GivenSlopes kept;
  if (problem.slopes == Slopes::WhereNeeded && options.near)
    kept = kept_slopes(*options.near, options.near->check_jacobian, model.parts);
  return slopes(problem, model.parts, cell::Split::Check, model.residual, std::move(kept), options.threads);
}

}  // namespace

Setup setup_of(const ComparisonData& data, const std::vector<Part>& parts) {
  Setup out = data.recording->cell;
  for (const Part& part : parts) apply(out, part.candidate->hypothesis, part.x);
  return out;
}

void add_slope(const ComparisonData& data, double factor, const Model& model, Eigen::Index coordinate,
               Eigen::VectorXd& stacked) {
  add(data, factor, model.jacobian[static_cast<std::size_t>(coordinate)], stacked);
  add(data, factor, model.check_jacobian[static_cast<std::size_t>(coordinate)], stacked);
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
  out.check_jacobian = check_slopes(problem, options, out);
  predict_check(problem, out);
  return out;
}

void predict_check(const FitProblem& problem, Model& model) {
  const Eigen::VectorXd r = check_rest(problem, model.residual);
  model.check_information = gram(model.check_jacobian, model.check_jacobian);
  Eigen::VectorXd gradient(static_cast<Eigen::Index>(model.check_jacobian.size()));
  for (Eigen::Index i = 0; i < gradient.size(); ++i) gradient(i) = dot(problem.data, model.check_jacobian[i], r);
  model.update = update_of(model, gradient);
  model.chi2_check = sum_of(problem.data, r, cell::Split::Check).chi2 - gradient.dot(model.update);
  model.log_evidence = log_evidence(problem, model);
}

Eigen::VectorXd updated(const FitProblem& problem, const Model& model) {
  Eigen::VectorXd out = check_rest(problem, model.residual);
  for (Eigen::Index i = 0; i < model.update.size(); ++i) add_slope(problem.data, -model.update(i), model, i, out);
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
