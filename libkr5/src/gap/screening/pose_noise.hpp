// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/gap/hypotheses.hpp>

#include "gap/screening/noise.hpp"

namespace kr5::gap {

/// Seen over declared noise of poses, which have no neighbours: what no combination of signatures of these hypotheses
/// takes away. Marks values that lie six times the noise seen off all of them; counts them in `stray`. Poses that show
/// hardly any noise tell of none.
std::vector<NoiseScale> pose_noise_scales(ComparisonData& data, const Eigen::VectorXd& residual,
                                          const std::vector<const Hypothesis*>& hypotheses, int& stray);

}  // namespace kr5::gap
