// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gap/data.hpp"
#include "gap/signature.hpp"

/// @file
/// Noise as the recording shows it, whatever effect is on the cell: from what changes between neighbouring samples.

namespace kr5::gap {

/// One key of `noise` in the cell.
struct NoiseScale {
  std::string key;
  double ratio = 1.0;  ///< Seen over declared.
  double std = 0.0;    ///< Of the ratio.
  double samples = 0.0;
};

/// Marks isolated spikes (six times the noise seen, against both neighbours) as not to be used. Returns how many.
int mark_spikes(Data& data, const Eigen::VectorXd& residual);

/// Seen over declared noise of each key that neighbours tell of, by the median of second differences (time, lines of a
/// scan) and of the part of a marker's four corners that no smooth shift has: right while less than half of them hold a
/// structure that fast.
std::vector<NoiseScale> noise_scales(const Data& data, const Eigen::VectorXd& residual);

/// The same for poses, which have no neighbours: what no combination of signatures takes away.
std::vector<NoiseScale> pose_noise_scales(const Data& data, const Eigen::VectorXd& residual,
                                          const std::vector<const Signature*>& signatures);

/// Whether a ratio is no chance (four standard deviations, and a twelfth at least).
bool wrong(const NoiseScale& scale);

/// Puts the noise seen in the place of the declared one, in the blocks and in residuals, for all wrong scales.
void correct(Data& data, const std::vector<NoiseScale>& scales, Eigen::VectorXd& residual);

}  // namespace kr5::gap
