// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/target.hpp>

namespace kr5::cell {

/// A target of the cell: what it is, and where.
struct Target : kr5::Target {
  std::string name;
  std::optional<Pose> T_base_target;    ///< Fixed in the base; or
  std::optional<Pose> T_flange_target;  ///< on the flange, before a camera in the base.

  static constexpr std::array<std::pair<std::string_view, std::string_view>, 2> file_keys = {
      {{"T_base_target", "T_B_W"}, {"T_flange_target", "T_F_W"}}};
  static constexpr std::array<std::string_view, 1> required = {"kind"};
  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the target.");
    kr5::Target::each_field(self, visit);
    visit("T_base_target", self.T_base_target, "Pose of the target in the base [m, rad].");
    visit("T_flange_target", self.T_flange_target, "Pose of the target on the flange [m, rad].");
  }
};

/// The marker board of the short form: `rows` x `cols` square markers numbered row by row from `first_id`.
struct Board {
  int rows = 0;
  int cols = 0;
  double marker = 0.0;  ///< [m]
  double gap = 0.0;     ///< [m]
  Pose T_base_target = Pose::Identity();
  std::string family = "36h11";
  int first_id = 0;

  /// The same in the general form.
  Target target() const;

  static constexpr std::array<std::pair<std::string_view, std::string_view>, 1> file_keys = {
      {{"T_base_target", "T_B_W"}}};
  static constexpr std::array<std::string_view, 5> required = {"rows", "cols", "marker", "gap", "T_B_W"};
  static void each_field(auto& self, auto&& visit) {
    visit("rows", self.rows, "Number of rows of markers.");
    visit("cols", self.cols, "Number of columns of markers.");
    visit("marker", self.marker, "Side of a marker [m].");
    visit("gap", self.gap, "Gap between markers [m].");
    visit("T_base_target", self.T_base_target,
          "Pose of the board in the base; corners of a marker are (0,0) (m,0) (m,m) (0,m) [m, rad].");
    visit("family", self.family, "Marker family.");
    visit("first_id", self.first_id, "Id of the first marker.");
  }
};

}  // namespace kr5::cell
