// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gap/reporting/residual_analysis.hpp"

/// @file
/// The figures of a diagnosis, on the experiments that were not used to fit.

namespace kr5::gap {

/// Part of sigma that a column with a known error must show: an error that is stated as far above what is seen says
/// that the column is not judged.
constexpr double min_judged = 0.5;

/// Factor from units of sigma to units of noise, of the columns of a group.
double inflation_of(const ComparisonData& data, const Group& group);

/// Whether a gap is more than noise alone shows once in 1000 columns.
bool above_floor(const Gap& gap);

/// The same of a column over the noise of its sensor alone; where this was estimated from the recording, by more than
/// it is uncertain.
bool above_noise(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted);
std::vector<bool> above_noise(const ComparisonData& data, const std::vector<Group>& groups,
                              const Eigen::VectorXd& counted);

/// RMS residual of the judged blocks of a group over the noise of their sensor.
double gap_over_noise(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted);

/// Columns above the noise (99.9 % of chi-square at their samples), structured or beyond what is known, largest share
/// of the excess first.
std::vector<ColumnExcess> column_excesses(const ComparisonData& data, const std::vector<Group>& groups,
                                          const ResidualAnalysis& rest);

/// The gap before and after over the columns that stand above the floor before.
GapReduction gap_reduction(const ComparisonData& data, const std::vector<Group>& groups, const std::vector<bool>& above,
                           const Eigen::VectorXd& before, const Eigen::VectorXd& after);

/// Part of the excess over those columns that goes from `without` to `with`.
double explained_fraction(const ComparisonData& data, const std::vector<Group>& groups, const std::vector<bool>& above,
                          const Eigen::VectorXd& without, const Eigen::VectorXd& with);

}  // namespace kr5::gap
