// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <kr5/core/statistics.hpp>

#include "gap/comparison_data.hpp"
#include "gap/screening/signature.hpp"

/// @file
/// Noise as the recording shows it, whatever effect is on the cell: from what changes between neighbouring samples.

namespace kr5::gap {

/// Less than this part of the declared noise is none: a coarse column, or a dead one.
inline constexpr double min_noise = 0.2;

/// One key of `noise` in the cell.
struct NoiseScale {
  std::string key;
  std::optional<cell::Kind> kind;  ///< Only in experiments of this kind; without: in all.
  double ratio = 1.0;              ///< Seen over declared.
  double std = 0.0;                ///< Of the ratio.
  double samples = 0.0;
};

/// Marks isolated spikes (seven times the noise seen, against both neighbours) as not to be used; near the rim of a
/// sphere only when the residual is that of the right cell. Returns how many.
int mark_spikes(ComparisonData& data, const Eigen::VectorXd& residual, bool near_edges = false);

/// Marks measured joint positions that repeat a coarse encoder's reading as not to be used: of equal readings in a row
/// the middle one stays, the others tell nothing new. Returns how many.
int mark_repeats(ComparisonData& data);

/// Marks corners that lie seven times the noise seen off what is smooth over their view. Returns how many.
int mark_stray_corners(ComparisonData& data, const Eigen::VectorXd& residual);

/// Seen over declared noise of each key that neighbours tell of, kind by kind where kinds differ, by the median of
/// second differences (time, lines of a scan) and of the part of a marker's four corners that no smooth shift has:
/// right while less than half of them hold a structure that fast.
std::vector<NoiseScale> noise_scales(const ComparisonData& data, const Eigen::VectorXd& residual,
                                     std::vector<ColumnName>& coarse);

/// Whether a ratio is no chance (four standard deviations, and a twelfth at least).
bool wrong(const NoiseScale& scale);

/// Puts the noise seen in the place of the declared one, in the blocks and in residuals.
void correct(ComparisonData& data, const std::vector<NoiseScale>& scales, Eigen::VectorXd& residual);

/// The same of those scales alone that are no chance, which are returned.
std::vector<NoiseScale> correct_wrong(ComparisonData& data, std::vector<NoiseScale> scales, Eigen::VectorXd& residual);

}  // namespace kr5::gap
