// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <kr5/cell/placed_object.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Zones of a cell that an arm must stay clear of.

namespace kr5::identification {

enum class KeepOutKind {
  Box,    ///< Origin in its centre, sides along its axes; a side may be 0.
  Ball,   ///< Origin in its centre.
  Floor,  ///< All that lies below its X-Y plane.
};
constexpr auto enum_names(KeepOutKind) {
  return names<KeepOutKind>({{KeepOutKind::Box, "box"}, {KeepOutKind::Ball, "ball"}, {KeepOutKind::Floor, "floor"}});
}

/// The straight line between two points [m].
struct LineSegment {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
};

struct KeepOut {
  std::string name;
  KeepOutKind kind = KeepOutKind::Box;
  Pose T_base_object = Pose::Identity();           ///< Where it lies.
  Eigen::Vector3d size = Eigen::Vector3d::Zero();  ///< [m]
  double radius = 0.0;                             ///< [m]

  /// @throws InvalidArgument naming zone and field.
  void validate() const;
  /// Distance of the nearest point of a segment in the base [m]: exact outside of the zone; inside 0 for a box, less
  /// than 0 for a ball and a floor.
  double distance(const LineSegment& segment) const;

  static constexpr std::array<std::pair<std::string_view, std::string_view>, 1> file_keys = {
      {{"T_base_object", "T_B_O"}}};
  static constexpr std::array<std::string_view, 2> required = {"name", "kind"};
  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the zone.");
    visit("kind", self.kind, "Kind: box | ball | floor.");
    visit("T_base_object", self.T_base_object, "Pose of the zone in the base B [m, rad].");
    visit("size", self.size, "Sides of a box along its axes, its origin in the middle [m].");
    visit("radius", self.radius, "Radius of a ball [m].");
  }
};

/// The zone of an object of a cell: a ball as it is, of a tube and a plate the box about it.
KeepOut keep_out_of(const cell::PlacedObject& object);

/// Reads a YAML file whose key `keep_out` is a list of zones.
/// @throws IoError with file, line, field, what was found and what was expected; InvalidArgument as validate() does.
std::vector<KeepOut> load_keep_out(const std::filesystem::path& file);

}  // namespace kr5::identification
