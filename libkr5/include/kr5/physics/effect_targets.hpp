// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>

namespace kr5::physics {

/// @throws InvalidArgument naming an effect on a joint, motor or other part that the cell does not have.
void check_effect_targets(const cell::Cell& cell);

}  // namespace kr5::physics
