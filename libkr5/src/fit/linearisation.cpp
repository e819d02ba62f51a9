// SPDX-License-Identifier: BSD-3-Clause
#include "fit/linearisation.hpp"

#include <algorithm>

#include <Eigen/Dense>
#include <kr5/core/linear.hpp>

namespace kr5::fit {
namespace {

/// Where the columns of each block of a group begin.
struct GroupColumns {
  std::vector<int> blocks;  ///< Of the whole group, each once.
  std::vector<Eigen::Index> first;

  Eigen::Index first_of(int block) const {
    return first[static_cast<std::size_t>(std::find(blocks.begin(), blocks.end(), block) - blocks.begin())];
  }
};

GroupColumns columns_of(const std::vector<const StoredMeasurement*>& group, const FreeCoordinates& free,
                        std::vector<int>& index) {
  GroupColumns out;
  for (const StoredMeasurement* e : group)
    for (const int b : e->blocks) {
      if (std::find(out.blocks.begin(), out.blocks.end(), b) != out.blocks.end()) continue;
      out.blocks.push_back(b);
      out.first.push_back(static_cast<Eigen::Index>(index.size()));
      for (const int place : free.places[static_cast<std::size_t>(b)])
        if (place >= 0) index.push_back(place);
    }
  return out;
}

/// Residuals and derivatives of one measurement, to be written from row `first` of its group.
bool linearise_one(const ProblemData& data, const FreeCoordinates& free, const StoredMeasurement& e, int rows,
                   double weight, const GroupColumns& columns, Eigen::Index first, GroupDerivatives& out) {
  std::vector<RowMatrix> jacobians(e.blocks.size());
  std::vector<double*> by;
  for (std::size_t k = 0; k < jacobians.size(); ++k) {
    const Block& block = data.blocks[static_cast<std::size_t>(e.blocks[k])];
    if (block.any_free()) jacobians[k].resize(rows, block.values.size());
    by.push_back(block.any_free() ? jacobians[k].data() : nullptr);
  }
  if (!data.evaluate(e, data.values(e).data(), rows, weight, out.r.data() + first, by.data())) return false;
  for (std::size_t k = 0; k < e.blocks.size(); ++k) {
    const auto b = static_cast<std::size_t>(e.blocks[k]);
    const Block& block = data.blocks[b];
    if (block.nuisance) out.N.middleRows(first, rows) = jacobians[k].leftCols(out.N.cols());
    Eigen::Index column = columns.first_of(e.blocks[k]);
    for (int i = 0; i < block.size(); ++i)
      if (free.places[b][static_cast<std::size_t>(i)] >= 0)
        out.J.block(first, column++, rows, 1) = block.ratio[i] * jacobians[k].col(i);
  }
  return true;
}

}  // namespace

std::optional<GroupDerivatives> linearise(const ProblemData& data, const FreeCoordinates& free,
                                          const std::vector<const StoredMeasurement*>& group, bool condensed,
                                          std::optional<double> weight) {
  const auto rows_of = [&](const StoredMeasurement* e) { return condensed ? data.condensed_rows(*e) : e->rows; };
  Eigen::Index rows = 0;
  for (const StoredMeasurement* e : group) rows += rows_of(e);
  GroupDerivatives out;
  out.r.resize(rows);
  const GroupColumns columns = columns_of(group, free, out.index);
  out.J = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(out.index.size()));
  if (const int nuisance = group.front()->nuisance; nuisance >= 0) {
    const Block& block = data.blocks[static_cast<std::size_t>(nuisance)];
    out.N = Eigen::MatrixXd::Zero(rows, block.size());
    out.prior = Eigen::MatrixXd::Zero(block.size(), block.size());
    if (block.prior.size())
      out.prior = block.prior.cwiseInverse().asDiagonal() * block.change_by_coordinates(block.values.data());
  }
  Eigen::Index first = 0;
  for (const StoredMeasurement* e : group) {
    const int own_rows = rows_of(e);
    if (!linearise_one(data, free, *e, own_rows, weight.value_or(e->weight), columns, first, out)) return std::nullopt;
    first += own_rows;
  }
  return out;
}

std::vector<std::vector<const StoredMeasurement*>> groups(const ProblemData& data, const FreeCoordinates& free) {
  std::vector<std::vector<const StoredMeasurement*>> out;
  for (const std::vector<int>& entries : free.of_nuisance) {
    if (entries.empty()) continue;
    for (std::vector<const StoredMeasurement*>& group = out.emplace_back(); const int i : entries)
      group.push_back(&data.entries[static_cast<std::size_t>(i)]);
  }
  for (const StoredMeasurement& e : data.entries)
    if (e.weight > 0 && e.nuisance < 0) out.push_back({&e});
  return out;
}

WithoutNuisance eliminate(const Eigen::MatrixXd& N, const Eigen::MatrixXd& prior) {
  constexpr double taken_up = 1e-9;  // share of a direction that is left where the nuisance takes it up
  const Eigen::MatrixXd inner = N.transpose() * N + prior.transpose() * prior;
  const Eigen::MatrixXd rest =
      Eigen::MatrixXd::Identity(N.rows(), N.rows()) - N * inner.ldlt().solve(Eigen::MatrixXd(N.transpose()));
  const SymmetricEigen eigen = symmetric_eigen(rest);
  const Eigen::VectorXd remains = eigen.values.unaryExpr([](double v) { return v > taken_up ? 1.0 : 0.0; });
  WithoutNuisance out;
  out.M = eigen.vectors * remains.cwiseProduct(eigen.values.cwiseMax(0.0).cwiseSqrt()).asDiagonal() *
          eigen.vectors.transpose();
  out.P = eigen.vectors * remains.asDiagonal() * eigen.vectors.transpose();
  out.rank = static_cast<int>(remains.sum());
  return out;
}

Eigen::MatrixXd without_nuisance(const GroupDerivatives& at) {
  const Eigen::Index k = at.N.cols(), rows = at.N.rows();
  if (k == 0) return at.J;
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(rows + k, k), J = Eigen::MatrixXd::Zero(rows + k, at.J.cols());
  N.topRows(rows) = at.N, J.topRows(rows) = at.J;
  N.bottomRows(k) = at.prior;
  const Eigen::HouseholderQR<Eigen::MatrixXd> turn(N);
  J.applyOnTheLeft(turn.householderQ().adjoint());
  return J.bottomRows(rows);
}

}  // namespace kr5::fit
