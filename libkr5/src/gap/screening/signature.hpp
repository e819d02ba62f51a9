// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/error.hpp>
#include <kr5/gap/hypotheses.hpp>

#include "gap/comparison_data.hpp"

/// @file
/// What an effect changes in the prediction, in units of noise, and where.

namespace kr5::gap {

/// A stacked vector of which only some blocks are not zero, in rising order.
struct Signature {
  std::vector<std::pair<int, Eigen::VectorXf>> parts;

  bool empty() const { return parts.empty(); }
};

double dot(const Signature& a, const Signature& b);
double dot(const ComparisonData& data, const Signature& a, const Eigen::VectorXd& stacked);
/// stacked += factor a
void add(const ComparisonData& data, double factor, const Signature& a, Eigen::VectorXd& stacked);
/// out += factor times what a stacked vector holds of these experiments.
void add(const ComparisonData& data, double factor, const Eigen::VectorXd& stacked, const std::vector<int>& experiments,
         Signature& out);
Eigen::MatrixXd gram(const std::vector<Signature>& a, const std::vector<Signature>& b);

/// Prediction less prediction, from residuals `before` and `after` of these experiments: before - after.
Signature difference(const ComparisonData& data, const std::vector<int>& experiments, const Eigen::VectorXd& before,
                     const Eigen::VectorXd& after, double factor = 1.0);

/// Sets an effect in a setup.
void apply(Setup& setup, const Hypothesis& hypothesis, const Eigen::VectorXd& x);

/// Stacked residuals of a setup in some experiments; the others as in `base`.
Eigen::VectorXd residuals(const ComparisonData& data, const Setup& setup, const std::vector<int>& experiments,
                          const Eigen::VectorXd& base);

/// What a computation of residuals gives; nothing where the cell that it simulates does not exist, e.g. has a joint
/// without inertia.
template <class Compute>
std::optional<Eigen::VectorXd> where_possible(const Compute& compute) {
  try {
    return compute();
  } catch (const InvalidArgument&) {
    return std::nullopt;
  }
}

/// Experiments whose prediction a hypothesis changes, found by simulating short pieces of them; those the simulator
/// refuses are left out.
class AffectedExperiments {
 public:
  explicit AffectedExperiments(const ComparisonData& data);
  std::vector<int> experiments(const Hypothesis& hypothesis) const;

 private:
  struct Piece {
    cell::Experiment experiment;
    io::Table nominal;
  };
  void add(int experiment, const std::vector<Eigen::Index>& rows);

  const ComparisonData& data_;
  std::vector<Piece> pieces_;
};

/// Experiments of a split among these.
std::vector<int> experiments_of_split(const ComparisonData& data, const std::vector<int>& experiments,
                                      cell::Split split);

}  // namespace kr5::gap
