// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/cell/recording.hpp>

namespace kr5::cell {

/// Whether the direction in which each joint moves is known, rows x joints: 1 where the speed that the positions qc of
/// a motion give is two of its standard deviations or more, 0 elsewhere. 1 in all rows of a joint of which it is known
/// in less than a tenth, since nothing else tells of it, and where no noise of the speeds is stated.
/// @throws InvalidArgument for an experiment without t or qc of every joint, or noise of another number of joints.
Eigen::ArrayXXd known_directions(const Experiment& experiment, int joints);

}  // namespace kr5::cell
