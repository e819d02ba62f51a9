// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

namespace kr5::identification {

/// Columns of a matrix that those before them do not span, and every column as a combination of these.
struct ColumnGrouping {
  std::vector<Eigen::Index> kept;
  Eigen::MatrixXd combination;  ///< Kept x all: A = A_kept combination.
};

/// Part of a column below which it adds nothing that a measurement could tell: a twist of a millionth of a right angle
/// makes no further parameters [-].
constexpr double negligible_column = 1e-4;

/// Groups the columns of A, taken in the given order. A column whose rest is below `tolerance` of its own length is
/// spanned by those before it; one below 1e-12 of the longest is zero.
ColumnGrouping grouped_columns(const Eigen::MatrixXd& A, const std::vector<Eigen::Index>& order,
                               double tolerance = negligible_column);

}  // namespace kr5::identification
