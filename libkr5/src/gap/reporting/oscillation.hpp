// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "gap/reporting/structure.hpp"

namespace kr5::gap {

/// The one oscillation over time that makes up most of a column, by least squares at every frequency that its rows
/// resolve. Nothing where noise has one as large, by the false-alarm rate `level` over all frequencies, or where it is
/// not the main part: a motion that repeats itself makes any residual repeat itself, too. `counted`: residuals over the
/// noise.
std::optional<Dependence> main_oscillation(const ComparisonData& data, const Group& group,
                                           const Eigen::VectorXd& counted, double level);

}  // namespace kr5::gap
