// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/noise.hpp>

namespace kr5::cell {
static_assert(HasFields<Noise>);
}  // namespace kr5::cell
