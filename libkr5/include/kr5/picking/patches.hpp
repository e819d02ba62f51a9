// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/picking/cloud.hpp>

/// @file
/// Smooth pieces of surface in a cloud (Hayat et al. 2022, section 2.3.1): uniform sampling, lone points out;
/// neighbours, normals and region growing by PCL.

namespace kr5::picking {

enum class PatchKind {
  Curved,  ///< Side of a cylinder: normals spread in a plane.
  Flat,    ///< End face: all normals alike.
  Mixed,   ///< Neither: more than one surface.
};
constexpr auto enum_names(PatchKind) {
  return names<PatchKind>({{PatchKind::Curved, "curved"}, {PatchKind::Flat, "flat"}, {PatchKind::Mixed, "mixed"}});
}

/// A piece of surface without edges.
struct Patch {
  PatchKind kind = PatchKind::Mixed;
  std::vector<int> points;                             ///< Columns of the cloud, of the uniform sample.
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   ///< Mean of the normals, towards the sensor.
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();     ///< Square to all normals when curved, the normal when flat.

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "Kind of the surface.");
    visit("points", self.points, "Columns of the cloud that belong to the uniform sample of the patch.");
    visit("centroid", self.centroid, "Mean of the points [m].");
    visit("normal", self.normal, "Mean of the normals, towards the sensor.");
    visit("axis", self.axis, "Direction square to all normals of a curved patch; normal of a flat one.");
  }
};

struct PatchOptions {
  double spacing = 0.00125;
  double normal_radius = 0.0028;
  double smoothness = 0.33;
  double max_curvature = 0.04;
  double flat_limit = 0.05;
  double max_area = 3e-4;
  int min_points = 8;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;
  /// What suits cylinders of a radius in a cloud of this spacing [m].
  static PatchOptions for_radius(double radius, double pitch = 0.0);

  static void each_field(auto& self, auto&& visit) {
    visit("spacing", self.spacing, "Distance of the points of the uniform sample [m].");
    visit("normal_radius", self.normal_radius, "Radius of the neighbourhood of a normal [m].");
    visit("smoothness", self.smoothness, "Maximum angle between the normals of neighbours in a patch [rad].");
    visit("max_curvature", self.max_curvature,
          "Maximum ratio of the smallest eigenvalue of a neighbourhood to their sum from which a patch grows on [-].");
    visit("flat_limit", self.flat_limit,
          "Second over first eigenvalue of the scatter of the normals below which a patch is flat [-].");
    visit("max_area", self.max_area,
          "Area above which a patch may be more than one surface, and is also grown with half the angle and half the "
          "curvature [m^2].");
    visit("min_points", self.min_points, "Minimum number of points of a patch.");
  }
};

/// The patches of a cloud, greatest first; the parts of one that is too large stand beside it. Points that are not
/// finite are left out.
/// @param up Direction to the sensor, for rays whose origin is not known.
/// @throws InvalidArgument for an invalid cloud or options.
std::vector<Patch> find_patches(const Cloud& cloud, const Eigen::Vector3d& up, const PatchOptions& options = {});

}  // namespace kr5::picking
