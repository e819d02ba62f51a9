// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// What a camera may look at. All sizes in metres; the target frame has X along the columns, Y along the rows
/// (down in an upright picture of the board), Z into the board, so that a camera in front sees Z pointing away.

namespace kr5 {

enum class TargetKind {
  Chessboard,  ///< `rows` x `cols` inner corners, squares of `size`; first inner corner at the origin. The outermost
               ///< square beside the first corner, top left, is black.
  CircleGrid,  ///< `rows` x `cols` dots, `size` apart; first dot at the origin. If one corner dot is bigger, it is the
               ///< first (ROS-Industrial's "modified" grid).
  Tag,         ///< One square marker of side `size`, numbered `first_id`; origin at its centre.
  TagGrid,     ///< `rows` x `cols` markers of side `size` with `gap` between, ids row by row from `first_id`;
               ///< origin at the first corner of the first marker.
  Charuco,     ///< `rows` x `cols` squares of `size` with markers of side `marker` in the white ones, ids row by row
               ///< from `first_id`; origin at the outer corner of the first square, points are the inner corners.
  MarkerMap,   ///< Markers anywhere in space, listed in `map`.
};

constexpr auto enum_names(TargetKind) {
  return names<TargetKind>({{TargetKind::Chessboard, "chessboard"},
                            {TargetKind::CircleGrid, "circle_grid"},
                            {TargetKind::Tag, "tag"},
                            {TargetKind::TagGrid, "tag_grid"},
                            {TargetKind::Charuco, "charuco"},
                            {TargetKind::MarkerMap, "marker_map"}});
}

/// One marker of a map. Its own frame has the origin at the centre, X right, Y down, Z into the marker.
struct MapMarker {
  int id = 0;
  double size = 0.0;  ///< Side [m].
  Pose T_target_marker = Pose::Identity();

  static constexpr std::array<std::string_view, 3> required = {"id", "size", "T_target_marker"};
  static void each_field(auto& self, auto&& visit) {
    visit("id", self.id, "Id of the marker.");
    visit("size", self.size, "Side of the black square [m].");
    visit("T_target_marker", self.T_target_marker, "Pose of the marker (centre; X right, Y down, Z in) in the target.");
  }
};

/// What is wrong with one field of a description.
struct TargetProblem {
  std::string field;     ///< Such as `rows`, or `map[2].id`.
  std::string expected;  ///< In words.
  std::string found;
};

/// One board, marker or marker map.
struct Target {
  TargetKind kind = TargetKind::Chessboard;
  int rows = 0;
  int cols = 0;
  double size = 0.0;    ///< [m]
  double gap = 0.0;     ///< [m]
  double marker = 0.0;  ///< [m]
  std::string family = "36h11";
  int first_id = 0;
  bool legacy = false;  ///< ChArUco as OpenCV drew it up to 4.6: with an even number of rows the first square is white.
  std::vector<MapMarker> map;

  /// Everything that is wrong; empty for a target that can be used.
  std::vector<TargetProblem> problems() const;
  /// @throws InvalidArgument naming the first field of `problems`.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "Kind: chessboard | circle_grid | tag | tag_grid | charuco | marker_map.");
    visit("rows", self.rows, "Number of rows of inner corners, dots, markers or squares.");
    visit("cols", self.cols, "Number of columns of inner corners, dots, markers or squares.");
    visit("size", self.size, "Side of a square or marker, or distance of the dots [m].");
    visit("gap", self.gap, "Gap between the markers of a tag grid [m].");
    visit("marker", self.marker, "Side of the markers of a ChArUco board [m].");
    visit("family", self.family,
          "Marker family: 36h11 | 25h9 | 16h5 | 41h12, or an ArUco dictionary such as aruco_4x4_50, aruco_6x6_250.");
    visit("first_id", self.first_id, "Id of the (first) marker.");
    visit("legacy", self.legacy,
          "ChArUco drawn by OpenCV up to 4.6: with an even number of rows the first square is white, not black.");
    visit("map", self.map, "Markers of a marker map.");
  }
};

/// Every point of a target that a detector may find, with its number: the ids of a View index this list.
/// Chessboard corners, dots and ChArUco corners are numbered row by row; corners of markers 4 * id + corner, with the
/// id the marker shows (corners clockwise from the top left as printed).
struct TargetPoints {
  Eigen::Matrix3Xd points;  ///< [m]
  std::vector<int> ids;
};
TargetPoints target_points(const Target& target);

/// The markers a target carries (Tag, TagGrid, Charuco, MarkerMap; none otherwise), posed in its frame.
std::vector<MapMarker> target_markers(const Target& target);

/// Corners of a square of side `size` in its own frame, clockwise from the top left [m].
Eigen::Matrix<double, 3, 4> square_corners(double size);

/// Reads the short form of the command line, e.g. `chessboard:6x9:0.0236`, `circles:10x10:0.0254`,
/// `tag:36h11:10:0.048` (family, id, side), `grid:36h11:5x7:0.03:0.01` (rows x cols, side, gap),
/// `charuco:aruco_6x6_250:7x5:0.036195:0.018256` (family, squares, square, marker; `charuco_legacy:` for boards drawn
/// by OpenCV up to 4.6); rows first, lengths in metres. Marker maps are read from a file instead.
/// @throws InvalidArgument that shows the form.
Target parse_target(const std::string& text);

}  // namespace kr5
