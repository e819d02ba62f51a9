// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Every contact of a round peg with a tube or a bench, at any depth of insertion, for the simulation of forces.
/// Frame T: origin at the centre of the tube's top face, Z out of the tube (the bench is its plane z = 0).

namespace kr5::force {

/// Peg and tube with 45 degree chamfers.
struct PegTubeShape {
  double peg_radius = 0.0;    ///< [m]
  double peg_length = 0.0;    ///< [m]
  double peg_chamfer = 0.0;   ///< [m]
  double inner_radius = 0.0;  ///< [m]
  double outer_radius = 0.0;  ///< [m]
  double tube_depth = 0.0;    ///< [m]
  double tube_chamfer = 0.0;  ///< [m]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("peg_radius", self.peg_radius, "Radius of the peg [m].");
    visit("peg_length", self.peg_length, "Length of the peg [m].");
    visit("peg_chamfer", self.peg_chamfer, "Width of the chamfer of the peg's lower edge; 0 when sharp [m].");
    visit("inner_radius", self.inner_radius, "Radius of the bore [m].");
    visit("outer_radius", self.outer_radius, "Outer radius of the tube [m].");
    visit("tube_depth", self.tube_depth, "Length of the tube below its top face [m].");
    visit("tube_chamfer", self.tube_chamfer, "Width of the chamfer at the mouth of the bore; 0 when sharp [m].");
  }
};

/// Which features touch.
enum class ContactFeature {
  RimOnFace,  ///< An edge of the peg on a face of the tube (top, chamfer, bore, outside) or on the bench.
  EdgeOnPeg,  ///< An edge of the tube on a face of the peg (bottom, chamfer, side).
  EdgeEdge,   ///< An edge of each, crossing.
  Sample,     ///< A point that spreads the contact of a nearly upright peg along the edges.
};
constexpr auto enum_names(ContactFeature) {
  return names<ContactFeature>({{ContactFeature::RimOnFace, "rim_on_face"},
                                {ContactFeature::EdgeOnPeg, "edge_on_peg"},
                                {ContactFeature::EdgeEdge, "edge_edge"},
                                {ContactFeature::Sample, "sample"}});
}

/// One point of contact: moving the peg by `depth` along `normal` would end it.
struct ContactPoint {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< [-]
  double depth = 0.0;                                ///< [m]
  double weight = 1.0;                               ///< [-]
  ContactFeature touch = ContactFeature::RimOnFace;

  static void each_field(auto& self, auto&& visit) {
    visit("point", self.point, "Point of contact, in T [m].");
    visit("normal", self.normal, "Unit vector from tube to peg, in T [-].");
    visit("depth", self.depth, "Penetration of the peg along the normal [m].");
    visit("weight", self.weight, "Share of this point beside others of its depth, 0 to 1 [-].");
    visit("touch", self.touch, "Features in contact.");
  }
};

/// A list of contacts of fixed capacity: samples beyond it are dropped.
struct Contacts {
  static constexpr int capacity = 192;
  std::array<ContactPoint, capacity> points;
  int count = 0;

  void add(const ContactPoint& contact) noexcept {
    if (count < capacity) points[static_cast<std::size_t>(count++)] = contact;
  }
  const ContactPoint* begin() const noexcept { return points.data(); }
  const ContactPoint* end() const noexcept { return points.data() + count; }
  /// Greatest depth [m], 0 when nothing touches.
  double depth() const noexcept;
};

/// Contacts of the peg whose bottom centre and axis are the origin and Z of `T_tube_peg`, for tilts up to 80 degrees.
///
/// Each edge circle of either body is searched for its deepest points in the other one; where the faces on both sides
/// of an edge push alike, the two edges cross and their common perpendicular is the normal. Exact as long as the depth
/// is small against the radii (error about depth^2 / radius). Below 2.6 degrees of tilt, where the contact is an area,
/// samples of the edges join and carry all of their weight below 1 degree. Nothing is allocated.
Contacts peg_tube_contacts(const PegTubeShape& shape, const Pose& T_tube_peg) noexcept;

/// The same with a flat bench at z = 0 instead of the tube.
Contacts peg_bench_contacts(const PegTubeShape& shape, const Pose& T_tube_peg) noexcept;

}  // namespace kr5::force
