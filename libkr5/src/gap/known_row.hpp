// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>

namespace kr5::gap {

/// The row of an effect; null for one that the catalogue does not have, as a cause of one's own.
inline const cell::Effect* known_row(const std::string& effect) {
  try {
    return &cell::find_effect(effect);
  } catch (const InvalidArgument&) {
    return nullptr;
  }
}

}  // namespace kr5::gap
