// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <kr5/core/fields.hpp>

namespace kr5::gap {

/// An effect of the catalogue on its target.
struct EffectName {
  std::string effect;
  std::string target;

  friend bool operator==(const EffectName&, const EffectName&) = default;
  static void each_field(auto& self, auto&& visit) {
    visit("effect", self.effect, "Id in the catalogue.");
    visit("target", self.target, "Target of the effect.");
  }
};

}  // namespace kr5::gap
