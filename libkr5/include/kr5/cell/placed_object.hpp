// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <string_view>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/solid.hpp>

namespace kr5::cell {

/// A solid that stands in the cell, for camera and scanner to see: a pellet, a hole, a bench.
struct PlacedObject : Solid {
  std::string name;
  Pose T_B_O = Pose::Identity();

  static constexpr std::array<std::string_view, 2> required = {"kind", "T_B_O"};
  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the thing.");
    Solid::each_field(self, visit);
    visit("T_B_O", self.T_B_O, "Where it stands in B [m, rad].");
  }
};

}  // namespace kr5::cell
