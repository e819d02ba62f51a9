// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/solution.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Dense>
#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>

#include "fit/linearisation.hpp"

namespace kr5::fit {
namespace {

constexpr std::size_t most_named = 6;  // coordinates of a direction in its text

/// Directions that span the same space, each with as many zeros as elimination gives: readable by name.
Eigen::MatrixXd sparse_basis(Eigen::MatrixXd V) {
  for (Eigen::Index k = 0; k < V.cols(); ++k) {
    Eigen::Index row = 0;
    V.col(k).cwiseAbs().maxCoeff(&row);
    V.col(k) /= V(row, k);
    for (Eigen::Index other = 0; other < V.cols(); ++other)
      if (other != k) V.col(other) -= V(row, other) * V.col(k);
  }
  for (Eigen::Index k = 0; k < V.cols(); ++k) V.col(k).normalize();
  return V;
}

/// Directions on which no measurement depends, of unit length, each coordinate over its sensitivity.
Eigen::MatrixXd open_directions(const Eigen::MatrixXd& information, double tolerance) {
  const Eigen::VectorXd sensitivity = information.diagonal().cwiseSqrt();
  const double least = tolerance * std::max(sensitivity.size() ? sensitivity.maxCoeff() : 0.0, 1e-300) * 1e-6;
  const Eigen::VectorXd scale = sensitivity.unaryExpr([&](double s) { return s > least ? 1 / s : 0.0; });
  const SymmetricEigen eigen = symmetric_eigen(Eigen::MatrixXd(scale.asDiagonal() * information * scale.asDiagonal()));
  Eigen::Index count = 0;
  while (count < eigen.values.size() && eigen.values[count] <= tolerance * tolerance) ++count;
  return eigen.vectors.leftCols(count);
}

/// Coordinates that take part in a combination of such directions of which no prior knows anything either.
std::vector<int> undetermined_coordinates(const Eigen::MatrixXd& open, const Eigen::VectorXd& prior_information) {
  constexpr double part = 1e-3;  // of a coordinate in a direction, or of a direction in the coordinates with a prior
  if (open.cols() == 0) return {};
  Eigen::MatrixXd held = open;
  for (Eigen::Index i = 0; i < held.rows(); ++i)
    if (!(prior_information[i] > 0)) held.row(i).setZero();
  const SymmetricEigen prior = symmetric_eigen(Eigen::MatrixXd(held.transpose() * held));
  Eigen::VectorXd shares = Eigen::VectorXd::Zero(open.rows());
  for (Eigen::Index k = 0; k < open.cols() && prior.values[k] <= part * part; ++k)
    shares += (open * prior.vectors.col(k)).cwiseAbs2();
  std::vector<int> out;
  for (Eigen::Index i = 0; i < shares.size(); ++i)
    if (shares[i] > part) out.push_back(static_cast<int>(i));
  return out;
}

void name_unidentifiable(const Eigen::MatrixXd& open, Solution& solution) {
  const Eigen::MatrixXd directions = sparse_basis(open);
  for (Eigen::Index k = 0; k < directions.cols(); ++k) {
    UnidentifiableDirection out;
    out.direction = directions.col(k);
    std::vector<int> order(static_cast<std::size_t>(out.direction.size()));
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
    std::sort(order.begin(), order.end(),
              [&](int a, int b) { return std::abs(out.direction[a]) > std::abs(out.direction[b]); });
    for (const int i : order)
      if (std::abs(out.direction[i]) > 0.01 * std::abs(out.direction[order[0]]))
        out.coordinates.push_back(solution.coordinates[static_cast<std::size_t>(i)]);
    out.text = out.coordinates.size() == 1 ? "no measurement depends on " : "only together: ";
    const std::size_t named = out.coordinates.size() > most_named + 1 ? most_named : out.coordinates.size();
    for (std::size_t i = 0; i < named; ++i) out.text += (i ? ", " : "") + out.coordinates[i];
    if (named < out.coordinates.size()) out.text += " and " + std::to_string(out.coordinates.size() - named) + " more";
    solution.unidentifiable.push_back(std::move(out));
  }
}

/// Information of the measurements on the free coordinates, nuisances eliminated.
Eigen::MatrixXd data_information(const ProblemData& data, const FreeCoordinates& free) {
  const auto n = static_cast<Eigen::Index>(free.list.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
  for (const auto& group : groups(data, free)) {
    const auto at = linearise(data, free, group, true);
    if (!at) continue;
    const Eigen::MatrixXd J = without_nuisance(*at);
    const Eigen::MatrixXd part = J.transpose() * J;
    for (std::size_t r = 0; r < at->index.size(); ++r)
      for (std::size_t c = 0; c < at->index.size(); ++c)
        H(at->index[r], at->index[c]) += part(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
  }
  return H;
}

Eigen::MatrixXd prior_information(const ProblemData& data, const FreeCoordinates& free) {
  const auto n = static_cast<Eigen::Index>(free.list.size());
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t b = 0; b < data.blocks.size(); ++b) {
    const Block& block = data.blocks[b];
    if (!block.prior.size() || block.nuisance) continue;
    const Eigen::MatrixXd by_coordinates = block.change_by_coordinates(block.values.data()) * block.ratio.asDiagonal();
    const Eigen::MatrixXd own =
        by_coordinates.transpose() * block.prior.cwiseAbs2().cwiseInverse().asDiagonal() * by_coordinates;
    for (int i = 0; i < block.size(); ++i)
      for (int k = 0; k < block.size(); ++k) {
        const int row = free.places[b][static_cast<std::size_t>(i)],
                  column = free.places[b][static_cast<std::size_t>(k)];
        if (row >= 0 && column >= 0) out(row, column) += own(i, k);
      }
  }
  return out;
}

/// Squared distance of residuals from zero, where they have the covariance Q; directions without variance do not count.
double squared_distance(const Eigen::MatrixXd& Q, const Eigen::VectorXd& residuals) {
  double out = 0.0;
  const SymmetricEigen eigen = symmetric_eigen(Q);
  const Eigen::VectorXd along = eigen.vectors.transpose() * residuals;
  for (Eigen::Index k = 0; k < along.size(); ++k)
    if (eigen.values[k] > 1e-9) out += along[k] * along[k] / eigen.values[k];
  return out;
}

}  // namespace

bool UnidentifiableDirection::involves(std::string_view block) const {
  const std::string start = std::string(block) + ".";
  return std::ranges::any_of(coordinates, [&](const std::string& coordinate) { return coordinate.starts_with(start); });
}

std::vector<int> Solution::places(FitBlock block) const {
  require(!free_.places.empty(), "Solution: solve() of the problem comes first");
  require(block.index >= 0 && block.index < static_cast<int>(free_.places.size()), "Solution: there is no such block");
  return free_.places[static_cast<std::size_t>(block.index)];
}

void Solution::add_uncertainty(const Problem& problem, double rank_tolerance) {
  const Eigen::MatrixXd information = data_information(*problem.data_, free_);
  const Eigen::MatrixXd open = open_directions(information, rank_tolerance);
  name_unidentifiable(open, *this);
  const Eigen::MatrixXd of_priors = prior_information(*problem.data_, free_);
  determined_ = kr5::covariance_of(information + of_priors, rank_tolerance);
  covariance = determined_;
  for (const int i : undetermined_coordinates(open, of_priors.diagonal())) {
    undetermined.push_back(coordinates[static_cast<std::size_t>(i)]);
    covariance.row(i).setZero();
    covariance.col(i).setZero();
    covariance(i, i) = std::numeric_limits<double>::infinity();
  }
}

Eigen::MatrixXd Solution::covariance_of(const std::vector<int>& places) const { return determined_(places, places); }

Agreement Solution::agreement(const Problem& problem, FitMeasurement measurement) const {
  return agreement(problem, std::span(&measurement, 1));
}

Agreement Solution::agreement(const Problem& problem, std::span<const FitMeasurement> measurements) const {
  require(!measurements.empty(), "Solution: agreement of no measurement");
  require(determined_.size() > 0, "Solution: solve() with its uncertainty comes first");
  const ProblemData& data = *problem.data_;
  const bool used = data.entry(measurements.front()).weight > 0;
  std::vector<const StoredMeasurement*> group;
  Agreement out;
  for (const FitMeasurement handle : measurements) {
    const StoredMeasurement& e = data.entry(handle);
    require((e.weight > 0) == used, "Solution: agreement of measurements of which some are in use");
    out.dof += e.rows;
    group.push_back(&e);
  }
  const auto at = linearise(data, free_, group, false, used ? std::nullopt : std::optional(1.0));
  if (!at) {
    out.squared_distance = std::numeric_limits<double>::infinity();
    out.residuals = Eigen::VectorXd::Constant(out.dof, out.squared_distance);
    out.redundancy = Eigen::VectorXd::Ones(out.dof);
    return out;
  }
  Eigen::MatrixXd J = at->J, own = Eigen::MatrixXd::Identity(out.dof, out.dof);
  out.residuals = at->r;
  if (at->N.cols() > 0) {
    const Block& nuisance = data.blocks[static_cast<std::size_t>(group.front()->nuisance)];
    const WithoutNuisance left = eliminate(at->N, at->prior);
    J = left.M * at->J;
    own = left.P;
    out.dof = left.rank;
    out.residuals = left.M * (nuisance.prior.size() ? Eigen::VectorXd(at->r - at->N * nuisance.change()) : at->r);
  }
  const Eigen::MatrixXd spread = J * covariance_of(at->index) * J.transpose();
  // A measurement that took part has pulled the answer towards itself, one that did not is as uncertain as both.
  const Eigen::MatrixXd Q = used ? Eigen::MatrixXd(own - spread) : Eigen::MatrixXd(own + spread);
  out.squared_distance = squared_distance(Q, out.residuals);
  out.redundancy = Q.diagonal();
  return out;
}

SquaredResiduals Solution::squared_residuals(const Problem& problem, std::span<const FitMeasurement> measurements,
                                             int first_row, int end_row) const {
  require(!free_.places.empty(), "Solution: solve() of the problem comes first");
  const ProblemData& data = *problem.data_;
  const auto n = static_cast<Eigen::Index>(free_.list.size());
  SquaredResiduals out{.gradient = Eigen::VectorXd::Zero(n), .information = Eigen::MatrixXd::Zero(n, n)};
  for (const FitMeasurement handle : measurements) {
    const StoredMeasurement& e = data.entry(handle);
    const int rows = std::min(end_row, e.rows) - first_row;
    if (!(e.weight > 0) || rows <= 0) continue;
    require(e.nuisance < 0, "Solution: squared residuals of a measurement with a nuisance");
    const auto about = linearise(data, free_, {&e}, false);
    if (!about) continue;
    const auto J = about->J.middleRows(first_row, rows);
    const auto r = about->r.segment(first_row, rows);
    out.squares += r.squaredNorm(), out.rows += rows;
    const Eigen::VectorXd g = J.transpose() * r;
    const Eigen::MatrixXd part = J.transpose() * J;
    for (std::size_t a = 0; a < about->index.size(); ++a) {
      out.gradient[about->index[a]] += g[static_cast<Eigen::Index>(a)];
      for (std::size_t b = 0; b < about->index.size(); ++b)
        out.information(about->index[a], about->index[b]) +=
            part(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
    }
  }
  return out;
}

/// Share of the prior of a nuisance that agrees with the data: 1 - variance after over variance before.
Eigen::VectorXd Solution::nuisance_redundancy(const Problem& problem, FitBlock nuisance) const {
  const ProblemData& data = *problem.data_;
  const Block& block = data.block(nuisance);
  std::vector<const StoredMeasurement*> of_block;
  for (const int i : free_.of_nuisance[static_cast<std::size_t>(nuisance.index)])
    of_block.push_back(&data.entries[static_cast<std::size_t>(i)]);
  const auto at = of_block.empty() ? std::nullopt : linearise(data, free_, of_block, true);
  if (!at) return Eigen::VectorXd::Zero(block.size());
  const Eigen::MatrixXd inner = at->N.transpose() * at->N + at->prior.transpose() * at->prior;
  const Eigen::MatrixXd alone = inner.ldlt().solve(Eigen::MatrixXd::Identity(block.size(), block.size()));
  const Eigen::MatrixXd by_others = alone * at->N.transpose() * at->J;
  const Eigen::MatrixXd after = alone + by_others * covariance_of(at->index) * by_others.transpose();
  return Eigen::VectorXd::Ones(block.size()) - (at->prior * after * at->prior.transpose()).diagonal();
}

Eigen::VectorXd Solution::prior_redundancy(const Problem& problem, FitBlock block) const {
  const Block& b = problem.data_->block(block);
  require(b.prior.size() > 0, b.name + " has no prior");
  require(determined_.size() > 0, "Solution: solve() with its uncertainty comes first");
  if (b.nuisance) return nuisance_redundancy(problem, block);
  const std::vector<int> at = places(block);
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(b.size(), b.size());  // of the change from the start
  for (int i = 0; i < b.size(); ++i)
    for (int k = 0; k < b.size(); ++k) {
      const int row = at[static_cast<std::size_t>(i)], column = at[static_cast<std::size_t>(k)];
      if (row >= 0 && column >= 0) spread(i, k) = b.ratio[i] * b.ratio[k] * determined_(row, column);
    }
  const Eigen::MatrixXd by_coordinates = b.change_by_coordinates(b.values.data());
  const Eigen::VectorXd variance = (by_coordinates * spread * by_coordinates.transpose()).diagonal();
  Eigen::VectorXd out = Eigen::VectorXd::Zero(b.size());
  for (int i = 0; i < b.size(); ++i)
    if (at[static_cast<std::size_t>(i)] >= 0) out[i] = 1 - variance[i] / (b.prior[i] * b.prior[i]);
  return out;
}

}  // namespace kr5::fit
