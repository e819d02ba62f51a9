// SPDX-License-Identifier: BSD-3-Clause
#include "gap/fitting/nuisance_model.hpp"

#include <functional>

#include <Eigen/Cholesky>

#include <kr5/core/error.hpp>
#include <kr5/core/parallel.hpp>

namespace kr5::gap {
namespace {

using Change = std::function<void(cell::Cell&, double)>;

/// Relative changes of all nuisance parameters.
std::vector<Change> changes(const cell::Cell& cell) {
  std::vector<Change> out;
  for (std::size_t i = 0; i < cell.robot.links.size(); ++i)
    out.push_back([i](cell::Cell& c, double d) {
      c.robot.links[i].mass *= 1 + d;
      c.robot.links[i].inertia *= 1 + d;
    });
  if (cell.tool && cell.tool->mass > 0)
    out.push_back([](cell::Cell& c, double d) {
      c.tool->mass *= 1 + d;
      c.tool->inertia *= 1 + d;
    });
  if (!cell.drives) return out;
  for (int i = 0; i < cell.robot.joints(); ++i) {
    out.push_back([i](cell::Cell& c, double d) { c.drives->torque_constant(i) *= 1 + d; });
    out.push_back([i](cell::Cell& c, double d) { c.drives->friction.coulomb(i) *= 1 + 2 * d; });
    out.push_back([i](cell::Cell& c, double d) { c.drives->friction.viscous(i) *= 1 + 2 * d; });
  }
  return out;
}

bool depends_on_masses(cell::Kind kind) {
  return kind == cell::Kind::Motion || kind == cell::Kind::Press || kind == cell::Kind::Profile;
}

}  // namespace

NuisanceModel make_nuisance_model(const ComparisonData& data, const Eigen::VectorXd& base, int threads) {
  constexpr double step = 0.01;
  std::vector<int> experiments;
  for (std::size_t e = 0; e < data.recording->experiments.size(); ++e)
    if (depends_on_masses(data.recording->experiments[e].kind)) experiments.push_back(static_cast<int>(e));
  const std::vector<Change> all = changes(data.recording->cell);
  NuisanceModel out;
  out.signatures.resize(all.size());
  parallel_for(static_cast<int>(all.size()), threads, [&](int i) {
    cell::Cell cell = data.recording->cell;
    all[i](cell, step);
    try {
      out.signatures[i] = difference(data, experiments, base, residuals(data, cell, experiments, base), 1 / step);
    } catch (const InvalidArgument&) {
      out.signatures[i] = {};
    }
  });
  std::erase_if(out.signatures, [](const Signature& s) { return s.empty(); });
  std::vector<Signature> fit(out.signatures.size());
  for (std::size_t i = 0; i < fit.size(); ++i)
    for (const auto& part : out.signatures[i].parts)
      if (data.blocks[part.first].split == cell::Split::Fit) fit[i].parts.push_back(part);
  out.gram = gram(fit, fit);
  return out;
}

NuisancePrior::NuisancePrior(const NuisanceModel& nuisance, double size) {
  if (size <= 0 || nuisance.empty()) return;
  size_ = size;
  const Eigen::Index n = nuisance.gram.rows();
  const Eigen::MatrixXd scaled = Eigen::MatrixXd::Identity(n, n) + size * size * nuisance.gram;
  const Eigen::LDLT<Eigen::MatrixXd> factor(scaled);
  log_det_ = factor.vectorD().array().log().sum();
  inverse_ = size * size * factor.solve(Eigen::MatrixXd::Identity(n, n));
}

Eigen::MatrixXd NuisancePrior::inner(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) const {
  if (size_ <= 0) return Eigen::MatrixXd::Zero(a.cols(), b.cols());
  return a.transpose() * inverse_ * b;
}

Eigen::VectorXd NuisancePrior::estimate(const Eigen::VectorXd& b) const { return inverse_ * b; }

Eigen::MatrixXd project(const NuisanceModel& nuisance, const std::vector<Signature>& columns) {
  Eigen::MatrixXd out(nuisance.signatures.size(), columns.size());
  for (Eigen::Index i = 0; i < out.rows(); ++i)
    for (Eigen::Index j = 0; j < out.cols(); ++j) out(i, j) = dot(nuisance.signatures[i], columns[j]);
  return out;
}

Eigen::VectorXd project(const ComparisonData& data, const NuisanceModel& nuisance, const Eigen::VectorXd& counted) {
  Eigen::VectorXd out(nuisance.signatures.size());
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    out(i) = 0.0;
    for (const auto& [block, values] : nuisance.signatures[i].parts)
      if (data.blocks[block].split == cell::Split::Fit)
        out(i) += values.cast<double>().dot(data.blocks[block].rows_of(counted));
  }
  return out;
}

Eigen::VectorXd without_nuisance(const ComparisonData& data, const NuisanceModel& nuisance, const NuisancePrior& prior,
                                 const Eigen::VectorXd& counted) {
  Eigen::VectorXd out = counted;
  if (prior.size() <= 0) return out;
  const Eigen::VectorXd eta = prior.estimate(project(data, nuisance, counted));
  for (Eigen::Index i = 0; i < eta.size(); ++i) add(data, -eta(i), nuisance.signatures[i], out);
  return out;
}

double nuisance_cost(const ComparisonData& data, const NuisanceModel& nuisance, const NuisancePrior& prior,
                     const Eigen::VectorXd& counted) {
  if (prior.size() <= 0) return 0.0;
  return prior.estimate(project(data, nuisance, counted)).squaredNorm() / (prior.size() * prior.size());
}

}  // namespace kr5::gap
