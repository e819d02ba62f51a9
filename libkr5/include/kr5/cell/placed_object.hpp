// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/solid.hpp>

namespace kr5::cell {

/// Solid in the cell that camera and scanner can see: a pellet, a hole, a bench.
struct PlacedObject : Solid {
  std::string name;
  Pose T_base_object = Pose::Identity();  ///< Where it stands.

  static constexpr std::array<std::pair<std::string_view, std::string_view>, 1> file_keys = {
      {{"T_base_object", "T_B_O"}}};
  static constexpr std::array<std::string_view, 2> required = {"kind", "T_B_O"};
  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the object.");
    Solid::each_field(self, visit);
    visit("T_base_object", self.T_base_object, "Pose of the object in the base B [m, rad].");
  }
};

}  // namespace kr5::cell
