// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/cell/recording.hpp>
#include <kr5/gap/measure.hpp>

#include "gap/reporting/row_labels.hpp"

/// @file
/// What of the cell a column shows, and the gap of all columns that have something in common.

namespace kr5::gap {

/// Gathers the gap of columns, and what they have in common.
class GapBreakdown {
 public:
  explicit GapBreakdown(const cell::Recording& recording);

  /// Counts a column of an experiment (by number): its noise, and recorded less simulated over it, NaN where the two
  /// cannot be compared.
  ColumnGap add(int experiment, const std::string& column, double sigma, const Eigen::VectorXd& residual);
  /// By subsystem, target, channel and experiment, and of the rows by pose region and speed.
  std::vector<GapPart> all() const;

 private:
  /// Columns that are split by what the arm was doing.
  struct ByCondition {
    std::string by;
    RowLabels words;
    std::vector<ColumnGap> columns = {};
    std::vector<std::string> names = {};
    std::vector<double> excess = {};  ///< What these rows add to that of their column.
  };

  const cell::Recording& recording_;
  std::vector<ColumnGap> columns_;
  std::vector<ByCondition> conditions_;
};

}  // namespace kr5::gap
