// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/gap/diagnosis.hpp>

#include "gap/comparison_data.hpp"

/// @file
/// Whether a residual is noise: its size, its run in time, and its dependence on all that was given, tested.

namespace kr5::gap {

/// The blocks of one column over all experiments of a kind.
struct Group {
  cell::Kind kind = cell::Kind::Motion;
  std::string column;
  std::vector<int> all;     ///< Blocks.
  std::vector<int> judged;  ///< Those of check experiments; all, when there are none.

  std::string name() const { return column_name(kind, column); }
};
std::vector<Group> make_groups(const ComparisonData& data);

/// Edges between bins of equal numbers of samples, fewer where many samples share a value.
std::vector<double> quantile_edges(Eigen::VectorXd values, int bins);

/// RMS of a group, and its samples; what is NaN is left out.
struct Gap {
  double rms = 0.0;
  double samples = 0.0;
};
Gap gap_of(const ComparisonData& data, const std::vector<int>& blocks, const Eigen::VectorXd& counted);

/// One test of a column: a chi-square sum of `dof` numbers that are standard normal in noise.
struct Test {
  Dependence dependence = {};  ///< That it finds, without evidence and share; of no variable: the size.
  double statistic = 0.0;
  double dof = 1.0;
};

/// All tests of a column. `scale`: residuals over noise, per residual over sigma.
std::vector<Test> tests(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted,
                        double scale = 1.0);

/// Probability that noise, plus a discrepancy whose sum of squares is `discrepancy`, is no smaller.
double p_value(const Test& test, double discrepancy);

/// What structure a column holds: the least p-value, corrected for all its tests, and the dependences found, strongest
/// first.
struct Structure {
  double p = 1.0;
  double strength = 0.0;  ///< Most that a test which finds one sees above noise, as a sum of squares.
  std::vector<Dependence> dependences;
};
Structure structure(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted, double discrepancy,
                    double level, double scale = 1.0);

/// The catalogue-free hypothesis: the most that one smooth shape in one column (a constant, or a line over what the
/// column may depend on, also against the direction of motion) takes from the sum of squares, less 2 log of the size a
/// prior of `width` noise allows it.
double best_free_shape(const ComparisonData& data, const std::vector<Group>& groups, const Eigen::VectorXd& counted,
                       double width);

}  // namespace kr5::gap
