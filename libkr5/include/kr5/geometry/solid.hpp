// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>
#include <string_view>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Solids of simple shape that rays of a camera or a scanner may hit.

namespace kr5 {

/// Points `origin + s direction`, s > 0.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();      ///< [m]
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< Of any length; distances are in units of it.

  Eigen::Vector3d at(double s) const { return origin + s * direction; }
  Ray in(const Pose& T_a_b) const { return {T_a_b.inverse() * origin, T_a_b.linear().transpose() * direction}; }
};

enum class SolidKind {
  Ball,   ///< Origin in its centre.
  Tube,   ///< Origin in the centre of its top face, Z out of it; the bore ends at a bottom at `depth`.
  Plate,  ///< A rectangle without thickness, origin in its middle, sides along X and Y.
};
constexpr auto enum_names(SolidKind) {
  return names<SolidKind>({{SolidKind::Ball, "ball"}, {SolidKind::Tube, "tube"}, {SolidKind::Plate, "plate"}});
}

/// Which surface of a solid.
enum class SolidFace { Outside, Top, Bore, Bottom };

/// Where a ray hits a solid first.
struct RayHit {
  double distance = std::numeric_limits<double>::infinity();  ///< In units of the ray's direction; infinite: nowhere.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();           ///< Out of the material, of length 1.
  SolidFace face = SolidFace::Outside;

  bool hit() const { return distance < std::numeric_limits<double>::infinity(); }
};

struct Solid {
  SolidKind kind = SolidKind::Ball;
  double radius = 0.0;        ///< [m]
  double inner_radius = 0.0;  ///< [m]
  double depth = 0.0;         ///< [m]
  double width = 0.0;         ///< [m]
  double height = 0.0;        ///< [m]
  double grey = 160.0;        ///< [grey]

  /// @throws InvalidArgument naming the field.
  void validate() const;
  /// First hit of a ray given in the frame of the solid.
  RayHit intersect(const Ray& ray) const;
  /// Radius of a sphere about `centre` that holds the whole solid [m].
  double bounding_radius() const;
  Eigen::Vector3d centre() const;

  static constexpr std::array<std::string_view, 1> required = {"kind"};
  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "Kind: ball | tube | plate.");
    visit("radius", self.radius, "Radius of a ball, or outer radius of a tube [m].");
    visit("inner_radius", self.inner_radius, "Radius of the bore of a tube [m].");
    visit("depth", self.depth, "Depth of the bore and length of the tube [m].");
    visit("width", self.width, "Size of a plate along X [m].");
    visit("height", self.height, "Size of a plate along Y [m].");
    visit("grey", self.grey, "Grey level in an image [grey, 0 to 255].");
  }
};

}  // namespace kr5
