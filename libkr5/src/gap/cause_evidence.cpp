// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/cause_evidence.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <variant>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>

#include "gap/nominal_parameter.hpp"
#include "gap/reporting/residual_owner.hpp"

namespace kr5::gap {
namespace {

/// Squares of residuals that are numbers.
struct Squares {
  double sum = 0.0;
  int rows = 0;

  void add(double residual) {
    if (std::isfinite(residual)) sum += residual * residual, ++rows;
  }
  double gap() const { return rows > 0 ? std::sqrt(sum / rows) : std::numeric_limits<double>::quiet_NaN(); }
};

/// Squares of rows that are numbers at two cells alike.
struct TwoSquares {
  Squares without, with;

  void add(const Eigen::MatrixXd& residuals, int at_without, int at_with) {
    for (Eigen::Index i = 0; i < residuals.rows(); ++i)
      if (std::isfinite(residuals(i, at_without)) && std::isfinite(residuals(i, at_with))) {
        without.add(residuals(i, at_without));
        with.add(residuals(i, at_with));
      }
  }
  double gain() const { return without.sum - with.sum; }
};

/// A column of a kind of experiment with the residuals that judge it.
struct ColumnGroup {
  std::string name;
  std::vector<const ResidualColumn*> judged;
};

/// In the order of the recording: of each column those to check, all where none is.
std::vector<ColumnGroup> column_groups(const cell::Recording& recording, const std::vector<ResidualColumn>& columns) {
  std::vector<ColumnGroup> all, check;
  for (const ResidualColumn& c : columns) {
    const cell::Experiment& e = recording.experiments[experiment_of(recording, c)];
    const std::string name = std::string(name_of(e.kind)) + "." + c.column;
    auto at = std::find_if(all.begin(), all.end(), [&](const ColumnGroup& g) { return g.name == name; });
    if (at == all.end()) {
      at = all.insert(all.end(), {name, {}});
      check.push_back({name, {}});
    }
    at->judged.push_back(&c);
    if (e.split == cell::Split::Check) check[static_cast<std::size_t>(at - all.begin())].judged.push_back(&c);
  }
  for (std::size_t k = 0; k < all.size(); ++k)
    if (!check[k].judged.empty()) all[k] = check[k];
  return all;
}

/// Share of what all columns lose is filled in once all are known.
std::vector<ColumnEvidence> column_evidence(const std::vector<ColumnGroup>& groups, int without, int with_all) {
  std::vector<ColumnEvidence> out;
  double total = 0.0;
  for (const ColumnGroup& group : groups) {
    TwoSquares squares;
    for (const ResidualColumn* c : group.judged) squares.add(c->residuals, without, with_all);
    out.push_back(
        {group.name, squares.without.gap(), squares.with.gap(), noise_limit(squares.with.rows), squares.gain()});
    total += std::max(squares.gain(), 0.0);
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const ColumnEvidence& a, const ColumnEvidence& b) { return a.share > b.share; });
  for (ColumnEvidence& c : out) c.share = total > 0 ? c.share / total : 0.0;
  return out;
}

std::vector<ExperimentEvidence> experiment_evidence(const cell::Recording& recording,
                                                    const std::vector<ResidualColumn>& columns, int without,
                                                    int with_all) {
  std::map<std::string, std::pair<double, double>> sums;  // excess, and what goes of it
  for (const ResidualColumn& c : columns) {
    TwoSquares squares;
    squares.add(c.residuals, without, with_all);
    if (!(squares.without.gap() > noise_limit(squares.without.rows))) continue;
    auto& [excess, closed] = sums[c.experiment];
    excess += squares.without.sum - squares.without.rows;
    closed += squares.gain();
  }
  std::vector<ExperimentEvidence> out;
  for (const cell::Experiment& e : recording.experiments)
    if (const auto at = sums.find(e.name); at != sums.end())
      out.push_back({e.name, at->second.second / at->second.first});
  return out;
}

/// Numbers of a parameter from its off value, one for each standard deviation; none of a pose that the cell lacks.
Eigen::VectorXd from_off(const ParameterEstimate& p, const std::optional<cell::EffectValue>& off) {
  const Eigen::VectorXd value = Eigen::Map<const Eigen::VectorXd>(p.value.data(), std::ssize(p.value));
  if (p.value.size() == 16) {
    const Pose* nominal = off ? std::get_if<Pose>(&*off) : nullptr;
    if (nominal == nullptr) return {};
    return pose_difference(*nominal,
                           Pose(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(value.data())));
  }
  if (!off) return value;
  if (const double* number = std::get_if<double>(&*off)) return value.array() - *number;
  const auto* vector = std::get_if<Eigen::VectorXd>(&*off);
  require(vector != nullptr && vector->size() == value.size(),
          p.name + ": found " + std::to_string(value.size()) + " numbers, not as many as the cell has");
  return value - *vector;
}

}  // namespace

double residual_gap(const Eigen::VectorXd& residuals) {
  Squares squares;
  for (const double r : residuals) squares.add(r);
  return squares.gap();
}

std::vector<JudgedColumn> judged_columns(const cell::Recording& recording, const std::vector<ResidualColumn>& columns,
                                         int which) {
  for (const ResidualColumn& c : columns) require_cell(c, "which", which);
  std::vector<JudgedColumn> out;
  for (const ColumnGroup& group : column_groups(recording, columns)) {
    JudgedColumn& column = out.emplace_back();
    Squares squares;
    for (const ResidualColumn* c : group.judged) {
      column.experiments.push_back(c->experiment);
      for (const double r : c->residuals.col(which)) squares.add(r);
    }
    column.column = group.name;
    column.rows = squares.rows;
    column.gap = squares.gap();
    column.limit = noise_limit(squares.rows);
  }
  return out;
}

CauseEvidence cause_evidence(const cell::Recording& recording, const std::vector<ResidualColumn>& columns, int without,
                             int with_all) {
  for (const ResidualColumn& c : columns) {
    require_cell(c, "without", without);
    require_cell(c, "with_all", with_all);
  }
  return {column_evidence(column_groups(recording, columns), without, with_all),
          experiment_evidence(recording, columns, without, with_all),
          {}};
}

std::optional<double> deviations_from_off(const cell::Cell& cell, const EffectName& effect,
                                          const std::vector<ParameterEstimate>& parameters) {
  const cell::Effect& row = cell::find_effect(effect.effect);
  std::optional<double> most;
  for (const ParameterEstimate& p : parameters) {
    const auto known = std::find_if(row.parameters.begin(), row.parameters.end(),
                                    [&](const cell::EffectParameter& of) { return of.name == p.name; });
    if (known != row.parameters.end() && !known->measures_size()) continue;
    const Eigen::VectorXd off = from_off(p, nominal_parameter(cell, effect, parameters, p.name));
    for (Eigen::Index k = 0; k < off.size() && k < std::ssize(p.std); ++k)
      if (const double std = p.std[static_cast<std::size_t>(k)]; std > 0)
        most = std::max(most.value_or(0.0), std::abs(off[k]) / std);
  }
  return most;
}

}  // namespace kr5::gap
