// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Height at which a tilted peg rests on the flat top of a tube: the depth profile of Hayat et al. 2022, section 5.5.
/// Frame T: origin at the centre of the tube's top face, Z out of the tube. The peg's axis, up from its bottom, is
/// (sin tilt cos alpha, sin tilt sin alpha, cos tilt), so `alpha` is the azimuth of the lowest point of its rim.

namespace kr5::force {

/// What carries the peg.
enum class RestContact {
  None,             ///< Nothing: the peg's bottom is inside the bore, beside the tube, or the arguments are not valid.
  Flat,             ///< The upright bottom lies on the top face.
  RimOnFace,        ///< The lowest point of the peg's rim stands on the top face.
  RimOnInnerEdge,   ///< The peg's rim crosses the edge of the bore.
  RimOnOuterEdge,   ///< The peg's rim crosses the outer edge.
  FaceOnOuterEdge,  ///< The peg's bottom face lies on one point of the outer edge.
};
constexpr auto enum_names(RestContact) {
  return names<RestContact>({{RestContact::None, "none"},
                             {RestContact::Flat, "flat"},
                             {RestContact::RimOnFace, "rim_on_face"},
                             {RestContact::RimOnInnerEdge, "rim_on_inner_edge"},
                             {RestContact::RimOnOuterEdge, "rim_on_outer_edge"},
                             {RestContact::FaceOnOuterEdge, "face_on_outer_edge"}});
}

/// Radii of a peg and a tube, sharp-edged.
struct PegTube {
  double peg_radius = 0.0;    ///< [m]
  double inner_radius = 0.0;  ///< [m]
  double outer_radius = 0.0;  ///< [m]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("peg_radius", self.peg_radius, "Radius of the peg [m].");
    visit("inner_radius", self.inner_radius, "Radius of the tube's bore; 0 for a solid rod [m].");
    visit("outer_radius", self.outer_radius, "Outer radius of the tube [m].");
  }
};

/// Where the peg rests. Derivatives are one-sided where the contact changes (the cusp over the bore).
struct PegRest {
  RestContact kind = RestContact::None;
  double height = 0.0;                                  ///< [m]; NaN for RestContact::None
  Eigen::Vector2d point = Eigen::Vector2d::Zero();      ///< [m]
  Eigen::Vector2d mirrored = Eigen::Vector2d::Zero();   ///< [m]
  Eigen::Vector2d by_centre = Eigen::Vector2d::Zero();  ///< [-]
  double by_alpha = 0.0;                                ///< [m/rad]
  double by_tilt = 0.0;                                 ///< [m/rad]

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "Contact that carries the peg.");
    visit("height", self.height, "Height of the peg's bottom centre above the top face, NaN for none [m].");
    visit("point", self.point, "Point of contact on the top face, in T [m].");
    visit("mirrored", self.mirrored,
          "Second point of contact on the cusp, where two points carry; otherwise the same [m].");
    visit("by_centre", self.by_centre, "Derivative of the height by the centre: against it the peg sinks [-].");
    visit("by_alpha", self.by_alpha, "Derivative of the height by alpha [m/rad].");
    visit("by_tilt", self.by_tilt, "Derivative of the height by tilt [m/rad].");
  }
};

/// Resting height of a peg whose bottom centre stands over `centre` in T [m]; tilt in (-pi/2, pi/2), alpha [rad].
///
/// The greatest height at which bottom and top face touch: exact, by the cases of section 5.5 with the first crossing
/// of the rim's ellipse and the tube's circle from the root of a quartic. A peg whose side alone would touch (leaning
/// in the bore, or beside the tube) gives RestContact::None; kr5/force/peg_tube_contact.hpp includes contacts at its
/// side.
PegRest rest_peg_on_tube(const PegTube& bodies, double tilt, double alpha, const Eigen::Vector2d& centre) noexcept;

/// The same on a tube that stands at `T_tube_actual` instead of at T: height along Z of T of the bottom centre, which
/// moves along that Z over `centre`; NaN when nothing carries the peg. Tilts of the tube below about 0.5 rad.
double resting_height(const PegTube& bodies, const Pose& T_tube_actual, double tilt, double alpha,
                      const Eigen::Vector2d& centre) noexcept;

/// Heights of many rows [m]; `T_tube_actual` as above. All spans have one length.
/// @throws InvalidArgument for unequal lengths or radii that are not valid.
void resting_heights(const PegTube& bodies, const Pose& T_tube_actual, std::span<const double> tilt,
                     std::span<const double> alpha, std::span<const double> cx, std::span<const double> cy,
                     std::span<double> height);

}  // namespace kr5::force
