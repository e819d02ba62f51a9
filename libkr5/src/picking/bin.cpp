// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/bin.hpp>

#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::picking {

void Bin::validate() const {
  require(T_base_bin.matrix().allFinite() && is_rotation(T_base_bin.linear()), "T_base_bin is no rigid motion");
  require(size.allFinite() && size.minCoeff() > 0, "size must be three positive numbers [m]");
  require(size.maxCoeff() < 10, "size: a length of 10 m or more is implausible; are these millimetres? [m]");
  require(wall_thickness >= 0 && std::isfinite(wall_thickness), "wall_thickness must not be negative [m]");
}

}  // namespace kr5::picking
