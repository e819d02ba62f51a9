// SPDX-License-Identifier: BSD-3-Clause
#include "gap/reporting/consistency.hpp"

#include <algorithm>
#include <map>

#include <kr5/core/linear.hpp>

#include "gap/reporting/variables.hpp"

namespace kr5::gap {
namespace {

constexpr int few_bins = 6;

/// Sums of residuals against the coordinates of a part, over some samples.
struct Sums {
  Eigen::VectorXd b;
  Eigen::MatrixXd A;
  std::map<std::size_t, double> seen;  ///< Information of each group.

  void add(std::size_t group, const Eigen::MatrixXd& slope, const Eigen::VectorXd& r) {
    if (b.size() == 0) {
      b = Eigen::VectorXd::Zero(slope.cols());
      A = Eigen::MatrixXd::Zero(slope.cols(), slope.cols());
    }
    b += slope.transpose() * r;
    A += slope.transpose() * slope;
    seen[group] += slope.squaredNorm();
  }
};

/// Samples sorted by what may matter: the sums of each piece.
using Pieces = std::map<int, Sums>;

/// What samples are sorted by, and their pieces.
struct Sorted {
  Variable by;
  Pieces pieces;
};

/// Slopes of the coordinates of a part along a block; coordinates that do nothing there are zero.
Eigen::MatrixXd slopes(const ComparisonData& data, const Model& model, std::size_t part, int block) {
  const Eigen::Index first = model.first_coordinate(part), n = model.parts[part].x.size();
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(data.blocks[block].rows, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (const auto* all : {&model.jacobian, &model.check_jacobian}) {
      if (static_cast<std::size_t>(first + i) >= all->size()) continue;
      for (const auto& [b, values] : (*all)[static_cast<std::size_t>(first + i)].parts)
        if (b == block) out.col(i) = values.cast<double>();
    }
  return out;
}

/// Chi-square of the sums of all pieces, and its degrees of freedom beyond one common size.
Test test_of(const Pieces& pieces) {
  Test out{{}, 0.0, 0.0};
  Eigen::MatrixXd total;
  const auto take = [&](const Sums& s, bool count) {
    const SymmetricEigen eigen = symmetric_eigen(s.A);
    for (Eigen::Index i = 0; i < s.b.size(); ++i) {
      const double value = eigen.values(i);
      if (value <= 1e-6 * std::max(total.trace(), 1e-9)) continue;
      const double along = eigen.vectors.col(i).dot(s.b);
      out.statistic += (count ? 1.0 : -1.0) * along * along / value;
      out.dof += count ? 1.0 : -1.0;
    }
  };
  Sums all;
  for (const auto& [piece, sums] : pieces) {
    if (total.size() == 0) {
      total = Eigen::MatrixXd::Zero(sums.A.rows(), sums.A.cols());
      all.b = Eigen::VectorXd::Zero(sums.b.size());
    }
    total += sums.A;
  }
  for (const auto& [piece, sums] : pieces) {
    take(sums, true);
    all.b += sums.b;
  }
  all.A = total;
  if (total.size() > 0) take(all, false);
  return out;
}

class Splitter {
 public:
  Splitter(const ComparisonData& data, const std::vector<Group>& groups, const Model& model, std::size_t part,
           const Eigen::VectorXd& counted)
      : data_(data), model_(model), part_(part), counted_(counted) {
    for (std::size_t g = 0; g < groups.size(); ++g) add(groups[g], g);
  }

  const std::map<std::string, Sorted>& all() const { return all_; }

 private:
  void add(const Group& group, std::size_t g) {
    Eigen::Index rows = 0;
    for (const int b : group.all) rows += data_.blocks[b].rows;
    Eigen::MatrixXd slope(rows, model_.parts[part_].x.size());
    Eigen::VectorXd r(rows);
    Eigen::Index at = 0;
    for (const int b : group.all) {
      const Block& block = data_.blocks[b];
      const auto own = data_.use.segment(block.first, block.rows).matrix();
      slope.middleRows(at, block.rows) = own.asDiagonal() * slopes(data_, model_, part_, b);
      r.segment(at, block.rows) = block.rows_of(counted_);
      at += block.rows;
    }
    if (slope.squaredNorm() == 0.0) return;
    at = 0;
    for (const int b : group.all) {
      const Block& block = data_.blocks[b];
      pieces_by({VariableKind::Experiment})[block.experiment].add(g, slope.middleRows(at, block.rows),
                                                                  r.segment(at, block.rows));
      at += block.rows;
    }
    pieces_by({VariableKind::ExperimentKind})[static_cast<int>(group.kind)].add(g, slope, r);
    pieces_by({VariableKind::WhichColumn})[static_cast<int>(g)].add(g, slope, r);
    for (const VariableValues& v : variables(data_, group, counted_)) {
      if (v.variable.kind == VariableKind::Prediction) continue;
      Variable by = v.variable;
      by.experiment = std::string(kr5::name_of(group.kind));
      add_bins(g, pieces_by(by), v, slope, r);
    }
  }

  Pieces& pieces_by(const Variable& variable) {
    Sorted& sorted = all_[symbol(variable)];
    sorted.by = variable;
    return sorted.pieces;
  }

  static void add_bins(std::size_t g, Pieces& pieces, const VariableValues& v, const Eigen::MatrixXd& slope,
                       const Eigen::VectorXd& r) {
    const std::vector<double> edges = quantile_edges(v.values, few_bins);
    std::vector<std::vector<Eigen::Index>> rows(edges.size() + 1);
    for (Eigen::Index i = 0; i < r.size(); ++i)
      rows[static_cast<std::size_t>(std::upper_bound(edges.begin(), edges.end(), v.values(i)) - edges.begin())]
          .push_back(i);
    for (std::size_t k = 0; k < rows.size(); ++k)
      if (!rows[k].empty()) pieces[static_cast<int>(k)].add(g, slope(rows[k], Eigen::all), r(rows[k]));
  }

  const ComparisonData& data_;
  const Model& model_;
  std::size_t part_;
  const Eigen::VectorXd& counted_;
  std::map<std::string, Sorted> all_;  ///< By the notation of the variable.
};

std::size_t most_seen(const Pieces& pieces) {
  std::map<std::size_t, double> sum;
  for (const auto& [piece, sums] : pieces)
    for (const auto& [group, value] : sums.seen) sum[group] += value;
  return std::max_element(sum.begin(), sum.end(), [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

}  // namespace

Inconsistency inconsistency(const ComparisonData& data, const std::vector<Group>& groups, const Model& model,
                            std::size_t part, const Eigen::VectorXd& counted, double discrepancy) {
  const Splitter splitter(data, groups, model, part, counted);
  Inconsistency out;
  double tests = 0.0;
  for (const auto& [name, sorted] : splitter.all()) {
    const Test test = test_of(sorted.pieces);
    if (test.dof < 1.0) continue;
    tests += 1.0;
    const double p = p_value(test, discrepancy);
    if (p > out.p || (p == out.p && test.statistic - test.dof < out.strength)) continue;
    out = {p, std::max(test.statistic - test.dof, 0.0), sorted.by, most_seen(sorted.pieces)};
  }
  out.p = std::min(1.0, out.p * tests);
  return out;
}

}  // namespace kr5::gap
