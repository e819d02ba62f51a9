// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>

namespace kr5 {

/// Part of the cell that carries the camera.
enum class Mount {
  EyeInHand,  ///< Camera on the flange, target fixed in the base.
  EyeToHand,  ///< Camera fixed in the base, target on the flange.
};

constexpr auto enum_names(Mount) {
  return names<Mount>({{Mount::EyeInHand, "eye_in_hand"}, {Mount::EyeToHand, "eye_to_hand"}});
}

}  // namespace kr5
