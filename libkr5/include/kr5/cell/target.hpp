// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// What a camera of the cell looks at. The fields, apart from name and place, are those of kr5::vision::Target, which
/// this module cannot use; frames and numbering are explained there.

namespace kr5::cell {

enum class TargetKind { Chessboard, CircleGrid, Tag, TagGrid, Charuco, MarkerMap };
constexpr auto enum_names(TargetKind) {
  return names<TargetKind>({{TargetKind::Chessboard, "chessboard"},
                            {TargetKind::CircleGrid, "circle_grid"},
                            {TargetKind::Tag, "tag"},
                            {TargetKind::TagGrid, "tag_grid"},
                            {TargetKind::Charuco, "charuco"},
                            {TargetKind::MarkerMap, "marker_map"}});
}

/// One marker of a map: origin at its centre, X right, Y down, Z into the marker.
struct MapMarker {
  int id = 0;
  double size = 0.0;  ///< [m]
  Pose T_target_marker = Pose::Identity();

  static constexpr std::array<std::string_view, 3> required = {"id", "size", "T_target_marker"};
  static void each_field(auto& self, auto&& visit) {
    visit("id", self.id, "Number the marker shows.");
    visit("size", self.size, "Side of the black square [m].");
    visit("T_target_marker", self.T_target_marker, "Pose of the marker in the target [m, rad].");
  }
};

/// Any board or marker map, and where it is.
struct Target {
  std::string name;
  TargetKind kind = TargetKind::TagGrid;
  int rows = 0;
  int cols = 0;
  double size = 0.0;    ///< [m]
  double gap = 0.0;     ///< [m]
  double marker = 0.0;  ///< [m]
  std::string family = "36h11";
  int first_id = 0;
  std::vector<MapMarker> map;
  std::optional<Pose> T_B_W;  ///< Fixed in the base; or
  std::optional<Pose> T_F_W;  ///< on the flange, before a camera in the base.

  static constexpr std::array<std::string_view, 1> required = {"kind"};
  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the target.");
    visit("kind", self.kind, "chessboard | circle_grid | tag | tag_grid | charuco | marker_map.");
    visit("rows", self.rows, "Inner corners, dots, markers or squares down.");
    visit("cols", self.cols, "The same across.");
    visit("size", self.size, "Square, dot distance or marker side [m].");
    visit("gap", self.gap, "Between the markers of a tag grid [m].");
    visit("marker", self.marker, "Side of the markers of a ChArUco board [m].");
    visit("family", self.family, "Marker family or ArUco dictionary.");
    visit("first_id", self.first_id, "Number of the (first) marker.");
    visit("map", self.map, "Markers of a marker map.");
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
