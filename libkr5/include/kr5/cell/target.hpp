// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/target.hpp>

namespace kr5::cell {

/// A target of the cell: what it is, and where.
struct Target : kr5::Target {
  std::string name;
  std::optional<Pose> T_B_W;  ///< Fixed in the base; or
  std::optional<Pose> T_F_W;  ///< on the flange, before a camera in the base.

  static constexpr std::array<std::string_view, 1> required = {"kind"};
  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the target.");
    kr5::Target::each_field(self, visit);
    visit("T_B_W", self.T_B_W, "Target in the base [m, rad].");
    visit("T_F_W", self.T_F_W, "Target in the flange [m, rad].");
  }
};

/// The marker board of the short form: `rows` x `cols` square markers numbered row by row from `first_id`.
struct Board {
  int rows = 0;
  int cols = 0;
  double marker = 0.0;  ///< [m]
  double gap = 0.0;     ///< [m]
  Pose T_B_W = Pose::Identity();
  std::string family = "36h11";
  int first_id = 0;

  /// The same in the general form.
  Target target() const;

  static constexpr std::array<std::string_view, 5> required = {"rows", "cols", "marker", "gap", "T_B_W"};
  static void each_field(auto& self, auto&& visit) {
    visit("rows", self.rows, "Markers down.");
    visit("cols", self.cols, "Markers across.");
    visit("marker", self.marker, "Side of a marker [m].");
    visit("gap", self.gap, "Between markers [m].");
    visit("T_B_W", self.T_B_W, "Board in the base; corners of a marker are (0,0) (m,0) (m,m) (0,m) [m, rad].");
    visit("family", self.family, "Marker family.");
    visit("first_id", self.first_id, "Number of the first marker.");
  }
};

}  // namespace kr5::cell
