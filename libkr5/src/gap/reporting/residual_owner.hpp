// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/gap/effect_fit.hpp>

namespace kr5::gap {

/// Number of the experiment that residuals are of. @throws InvalidArgument for residuals of another recording.
std::size_t experiment_of(const cell::Recording& recording, const ResidualColumn& column);

/// @param name Of the argument that says which cell. @throws InvalidArgument for a cell of which there are none.
void require_cell(const ResidualColumn& column, const char* name, int which);

}  // namespace kr5::gap
