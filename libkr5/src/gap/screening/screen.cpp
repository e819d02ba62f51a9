// SPDX-License-Identifier: BSD-3-Clause
#include "gap/screening/screen.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <set>

#include <Eigen/Cholesky>

#include <kr5/core/error.hpp>
#include <kr5/core/parallel.hpp>

namespace kr5::gap {
namespace {

/// What a list of columns would take from the residual, linear, base columns and nuisance parameters projected out.
struct Normal {
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
};

/// The columns a model already has: whatever a new effect shares with them is theirs as well.
class Projection {
 public:
  Projection(const FitProblem& problem, const Model& model)
      : problem_(problem), columns_(model.jacobian), residual_(counted_residual(problem.data, model.residual)) {
    if (problem.prior.size() > 0) nuisance_b_ = project(problem.data, problem.nuisance, residual_);
    const Eigen::Index n = static_cast<Eigen::Index>(columns_.size());
    b_.resize(n);
    for (Eigen::Index i = 0; i < n; ++i) b_(i) = dot(problem.data, columns_[i], residual_);
    if (n == 0) return;
    Eigen::MatrixXd A = gram(columns_, columns_);
    if (problem.prior.size() > 0) {
      nuisance_ = project(problem.nuisance, columns_);
      A -= problem.prior.inner(nuisance_, nuisance_);
      b_ -= problem.prior.inner(nuisance_, nuisance_b_);
    }
    A.diagonal().array() += 1e-9 + 1.0 / (prior_width * prior_width);
    factor_.compute(A);
  }

  Normal normal(const std::vector<Signature>& columns) const {
    Normal out{gram(columns, columns), Eigen::VectorXd(columns.size())};
    for (std::size_t i = 0; i < columns.size(); ++i) out.b(i) = dot(problem_.data, columns[i], residual_);
    Eigen::MatrixXd nuisance;
    if (problem_.prior.size() > 0) {
      nuisance = project(problem_.nuisance, columns);
      out.A -= problem_.prior.inner(nuisance, nuisance);
      out.b -= problem_.prior.inner(nuisance, nuisance_b_);
    }
    if (columns_.empty()) return out;
    Eigen::MatrixXd cross = gram(columns_, columns);
    if (problem_.prior.size() > 0) cross -= problem_.prior.inner(nuisance_, nuisance);
    const Eigen::MatrixXd solved = factor_.solve(cross);
    out.A -= cross.transpose() * solved;
    out.b -= solved.transpose() * b_;
    return out;
  }

  const Eigen::VectorXd& residual() const { return residual_; }

 private:
  const FitProblem& problem_;
  const std::vector<Signature>& columns_;
  Eigen::VectorXd residual_, b_, nuisance_b_;
  Eigen::MatrixXd nuisance_;
  Eigen::LDLT<Eigen::MatrixXd> factor_;
};

/// Gain of log evidence of adding these columns, and their coefficients.
double gain(const Normal& normal, Eigen::VectorXd& coefficients) {
  const Eigen::Index n = normal.b.size();
  const Eigen::MatrixXd ridge = normal.A + Eigen::MatrixXd::Identity(n, n) / (prior_width * prior_width);
  const Eigen::LDLT<Eigen::MatrixXd> factor(ridge);
  coefficients = factor.solve(normal.b);
  double out = 0.5 * normal.b.dot(coefficients);
  out -= 0.5 * (factor.vectorD().array().max(1e-12) * prior_width * prior_width).log().sum();
  out += 0.5 * coefficients.squaredNorm() / (prior_width * prior_width);  // the Cauchy prior below counts instead
  out -= (coefficients.array() / prior_width).square().log1p().sum();
  return out;
}

/// The point that coefficients of a probe's points mean.
Eigen::VectorXd start(const Hypothesis& h, const Probe& probe, const Eigen::VectorXd& coefficients) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(h.size());
  for (int i = 0; i < h.size(); ++i) {
    const Coordinate& c = h.coordinates[static_cast<std::size_t>(i)];
    if (c.shape) {
      x(i) = probe.points.front()(i);
      continue;
    }
    const double scale = probe.points.size() == 1 ? 1 / probe.points.front()(0) : 1.0;
    for (std::size_t k = 0; k < probe.points.size(); ++k)
      x(i) += coefficients(static_cast<Eigen::Index>(k)) * scale * probe.points[k](i);
    x(i) = std::clamp(x(i), c.lower, c.upper);
  }
  return x;
}

/// A single amplitude on the wrong side of its bound explains nothing.
bool out_of_bounds(const Hypothesis& h, const Eigen::VectorXd& coefficients) {
  return coefficients.size() == 1 &&
         (coefficients(0) <= h.coordinates.front().lower + 1e-12 && h.coordinates.front().lower >= 0);
}

/// Whether two columns are proportional, or one is empty: at a joint at rest, a spring or a ripple is only a constant
/// load.
bool parallel(const Signature& a, const Signature& b) {
  constexpr double sine = 5e-3;
  const double aa = dot(a, a), bb = dot(b, b), ab = dot(a, b);
  return aa * bb - ab * ab <= sine * sine * aa * bb;
}

/// Residuals of a cell with a hypothesis at x; those of the cell alone where there is no such cell.
Eigen::VectorXd residuals_with(const ComparisonData& data, const cell::Cell& about, const Hypothesis& h,
                               const Eigen::VectorXd& x, const std::vector<int>& experiments,
                               const Eigen::VectorXd& base) {
  Setup setup = about;
  apply(setup, h, x);
  return where_possible([&] { return residuals(data, setup, experiments, base); }).value_or(base);
}

/// Simulates the signatures of a candidate on the fit experiments. Probes that show nothing are left out: a limit shows
/// only once it is reached.
void simulate(const ComparisonData& data, Candidate& candidate, const cell::Cell& about, const Eigen::VectorXd& base) {
  const std::vector<int> experiments = experiments_of_split(data, candidate.experiments, cell::Split::Fit);
  const auto shows = [&](const Probe& probe) {
    std::vector<Signature> columns;
    for (const Eigen::VectorXd& x : probe.points) {
      const double factor = probe.points.size() == 1 ? 1 / x(0) : 1.0;
      const Eigen::VectorXd with = residuals_with(data, about, candidate.hypothesis, x, experiments, base);
      columns.push_back(difference(data, experiments, base, with, factor));
    }
    if (std::all_of(columns.begin(), columns.end(), [](const Signature& s) { return s.empty(); }) ||
        (probe.indivisible && columns.size() == 2 && parallel(columns[0], columns[1])))
      return false;
    candidate.signatures.push_back(std::move(columns));
    return true;
  };
  std::vector<Probe> seen;
  std::ranges::copy_if(candidate.hypothesis.probes, std::back_inserter(seen), shows);
  if (!seen.empty()) candidate.hypothesis.probes = std::move(seen);
}

std::vector<EffectName> unseen_effects(const std::vector<std::shared_ptr<Candidate>>& candidates) {
  std::vector<EffectName> out;
  for (const auto& candidate : candidates) {
    const EffectName name = candidate->hypothesis.name();
    if (candidate->hypothesis.of_recording || std::find(out.begin(), out.end(), name) != out.end()) continue;
    if (std::none_of(candidates.begin(), candidates.end(),
                     [&](const auto& c) { return c->hypothesis.name() == name && !c->signatures.empty(); }))
      out.push_back(name);
  }
  return out;
}

}  // namespace

Eigen::VectorXd nearly_off(const Hypothesis& h) {
  Eigen::VectorXd x = h.probes.front().points.front();
  for (Eigen::Index i = 0; i < x.size(); ++i)
    if (!h.coordinates[static_cast<std::size_t>(i)].shape) x(i) *= 0.01;
  return x;
}

Screen::Screen(const ComparisonData& data, std::vector<Hypothesis> hypotheses, const cell::Cell& about,
               const Eigen::VectorXd& base, int threads, const Progress& progress)
    : threads_(threads) {
  const std::size_t plain = hypotheses.size();
  const std::vector<PeriodicEffect> periodic = periodic_effects(data.recording->cell);
  for (const PeriodicEffect& effect : periodic)
    hypotheses.push_back(periodic_hypothesis(data.recording->cell, effect, 1));
  std::vector<std::shared_ptr<Candidate>> all;
  for (Hypothesis& h : hypotheses) all.push_back(std::make_shared<Candidate>(Candidate{std::move(h), {}, {}}));
  const AffectedExperiments touch(data);
  std::atomic<int> done{0};
  parallel_for(static_cast<int>(all.size()), threads, [&](int i) {
    all[i]->experiments = touch.experiments(all[i]->hypothesis);
    simulate(data, *all[i], about, base);
    if (progress) progress(static_cast<double>(++done) / static_cast<double>(all.size()));
  });
  std::vector<Carrier> carriers;
  for (std::size_t i = plain; i < all.size(); ++i)
    if (!all[i]->signatures.empty()) carriers.push_back(make_carrier(data, *all[i], periodic[i - plain].joint));
  unseen_ = unseen_effects(all);
  all.resize(plain);
  std::erase_if(all, [](const auto& c) { return c->signatures.empty(); });
  std::set<std::pair<std::string, std::string>> pairs;
  for (const auto& c : all) pairs.emplace(c->hypothesis.effect, c->hypothesis.target);
  effects_ = static_cast<int>(pairs.size() + carriers.size());
  candidates_.assign(all.begin(), all.end());
  carriers_ = std::make_shared<const std::vector<Carrier>>(std::move(carriers));
}

void Screen::add_periodic(const ComparisonData& data, const Eigen::VectorXd& left) {
  const std::vector<Carrier>& carriers = *carriers_;
  std::vector<std::vector<int>> cycles(carriers.size());
  parallel_for(static_cast<int>(carriers.size()), threads_,
               [&](int i) { cycles[i] = best_cycles(data, carriers[i], left, 2); });
  for (std::size_t i = 0; i < carriers.size(); ++i)
    for (const int c : cycles[i]) {
      Candidate candidate = modulated(data, carriers[i], c);
      const auto known = std::any_of(candidates_.begin(), candidates_.end(), [&](const auto& other) {
        return other->hypothesis.name() == candidate.hypothesis.name() &&
               other->hypothesis.choice == candidate.hypothesis.choice;
      });
      if (!known) candidates_.push_back(std::make_shared<const Candidate>(std::move(candidate)));
    }
}

std::vector<Suggestion> Screen::rank(const FitProblem& problem, const Model& model) {
  const Projection projection(problem, model);
  add_periodic(problem.data, projection.residual());
  std::vector<Suggestion> all(candidates_.size());
  parallel_for(static_cast<int>(candidates_.size()), threads_, [&](int i) {
    const Candidate& candidate = *candidates_[i];
    Suggestion& best = all[i];
    best.score = -1e300;
    if (model.has(candidate.hypothesis.name())) return;
    for (std::size_t p = 0; p < candidate.signatures.size(); ++p) {
      Eigen::VectorXd coefficients;
      const double score = gain(projection.normal(candidate.signatures[p]), coefficients) + problem.log_prior_effect +
                           candidate.hypothesis.log_prior;
      if (score <= best.score || out_of_bounds(candidate.hypothesis, coefficients)) continue;
      best = {{&candidate, start(candidate.hypothesis, candidate.hypothesis.probes[p], coefficients)}, score};
    }
  });
  std::erase_if(all, [](const Suggestion& s) { return s.part.candidate == nullptr; });
  std::sort(all.begin(), all.end(), [](const Suggestion& a, const Suggestion& b) { return a.score > b.score; });
  return all;
}

std::vector<PairSuggestion> Screen::rank_pairs(const FitProblem& problem, const Model& empty, std::size_t count) const {
  const Projection projection(problem, empty);
  struct PairMember {
    const Candidate* candidate;
    std::size_t probe;
    Normal normal;
    Eigen::MatrixXd nuisance;
  };
  std::vector<PairMember> entries;
  for (const auto& c : candidates_)
    for (std::size_t p = 0; p < c->signatures.size(); ++p) entries.push_back({c.get(), p, {}, {}});
  parallel_for(static_cast<int>(entries.size()), threads_, [&](int i) {
    const auto& columns = entries[i].candidate->signatures[entries[i].probe];
    entries[i].normal = projection.normal(columns);
    if (problem.prior.size() > 0) entries[i].nuisance = project(problem.nuisance, columns);
  });
  std::vector<std::vector<PairSuggestion>> found(entries.size());
  parallel_for(static_cast<int>(entries.size()), threads_, [&](int i) {
    const PairMember& a = entries[i];
    for (std::size_t j = static_cast<std::size_t>(i) + 1; j < entries.size(); ++j) {
      const PairMember& b = entries[j];
      const Hypothesis &ha = a.candidate->hypothesis, &hb = b.candidate->hypothesis;
      if (ha.name() == hb.name()) continue;
      Eigen::MatrixXd cross = gram(a.candidate->signatures[a.probe], b.candidate->signatures[b.probe]);
      if (problem.prior.size() > 0) cross -= problem.prior.inner(a.nuisance, b.nuisance);
      const Eigen::Index n = a.normal.b.size(), m = b.normal.b.size();
      Normal joint{Eigen::MatrixXd(n + m, n + m), Eigen::VectorXd(n + m)};
      joint.A << a.normal.A, cross, cross.transpose(), b.normal.A;
      joint.b << a.normal.b, b.normal.b;
      Eigen::VectorXd x;
      const double score = gain(joint, x) + 2 * problem.log_prior_effect + ha.log_prior + hb.log_prior;
      if (out_of_bounds(ha, x.head(n)) || out_of_bounds(hb, x.tail(m))) continue;
      found[i].push_back({{a.candidate, start(ha, ha.probes[a.probe], x.head(n))},
                          {b.candidate, start(hb, hb.probes[b.probe], x.tail(m))},
                          score});
    }
    std::sort(found[i].begin(), found[i].end(), [](const auto& x, const auto& y) { return x.score > y.score; });
    if (found[i].size() > count) found[i].resize(count);
  });
  std::vector<PairSuggestion> out;
  for (auto& list : found) out.insert(out.end(), list.begin(), list.end());
  std::sort(out.begin(), out.end(), [](const auto& x, const auto& y) { return x.score > y.score; });
  if (out.size() > count) out.resize(count);
  return out;
}

}  // namespace kr5::gap
