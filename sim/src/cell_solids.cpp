// SPDX-License-Identifier: BSD-3-Clause
#include "cell_solids.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kr5::sim {
namespace {

using Eigen::Vector3d;

constexpr double clear_gap = 2e-4;     // beyond which a pellet at 0.3 m/s meets nothing before it is asked again [m]
constexpr double most_tilted = 1.35;   // tilt in a tube up to which contacts of a peg are known [rad]
constexpr double soft = 5e-5;          // by which bodies that touch overlap at rest [m]
constexpr double plate_depth = 0.005;  // below a plate at which a pellet comes from its back [m]

CylinderBody in_frame(const CylinderBody& body, const Pose& T_base_frame) {
  CylinderBody out = body;
  out.centre = T_base_frame.inverse() * body.centre;
  out.rotation = T_base_frame.linear().transpose() * body.rotation;
  return out;
}

/// The rotation of a cylinder upside down: Z does not point down.
Eigen::Matrix3d upright(const Eigen::Matrix3d& R) {
  if (R(2, 2) >= 0.0) return R;
  return R * Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX()).toRotationMatrix();
}

double lowest(const CylinderBody& body) {
  const double cosine = std::min(std::abs(body.rotation(2, 2)), 1.0);
  return body.centre.z() - body.half * cosine - body.radius * std::sqrt(1 - cosine * cosine);
}

/// Contacts of a patch, given in a frame, that overlap and that `counts` lets pass.
void add_overlaps(const ContactPatch& patch, const Pose& T_base_frame, force::Contacts& out, auto&& counts) {
  for (const CylinderContact& c : patch)
    if (c.gap < 0.0 && counts(c.point))
      out.add({.point = T_base_frame * c.point, .normal = T_base_frame.linear() * c.normal, .depth = -c.gap});
}

bool over_plate(const Vector3d& point, const Eigen::Vector2d& size) {
  return std::abs(point.x()) <= 0.5 * size.x() && std::abs(point.y()) <= 0.5 * size.y();
}

void add_stand(const CylinderBody& body, const StandShape& stand, force::Contacts& out) {
  const CylinderBody there = in_frame(body, stand.T_base_stand);
  if (there.centre.z() < -plate_depth) return;
  add_overlaps(plane_contacts(there, {}, 0.0), stand.T_base_stand, out,
               [&](const Vector3d& point) { return over_plate(point, stand.size); });
}

void add_bin(const CylinderBody& body, const BinShape& bin, force::Contacts& out) {
  const CylinderBody there = in_frame(body, bin.T_base_bin);
  const PlaneBody planes[] = {{Vector3d::UnitZ(), 0.0},
                              {Vector3d::UnitX(), -0.5 * bin.size.x()},
                              {-Vector3d::UnitX(), -0.5 * bin.size.x()},
                              {Vector3d::UnitY(), -0.5 * bin.size.y()},
                              {-Vector3d::UnitY(), -0.5 * bin.size.y()}};
  for (const PlaneBody& plane : planes)
    add_overlaps(plane_contacts(there, plane, 0.0), bin.T_base_bin, out,
                 [&](const Vector3d& point) { return point.z() <= bin.size.z(); });
}

/// Of a pellet that is in the bore as a whole the upper rim touches its wall, too; of a peg only the lower one is
/// known.
void add_upper_rim(const CylinderBody& there, const Pose& T_base_tube, double bore, force::Contacts& out) {
  const Vector3d upper = there.centre + there.half * there.rotation.col(2);
  const double off = upper.head<2>().norm(), depth = off + there.radius - bore;
  if (upper.z() >= 0.0 || off == 0.0 || depth <= 0.0) return;
  const Vector3d outwards(upper.x() / off, upper.y() / off, 0.0);
  out.add({.point = T_base_tube * Vector3d(upper + there.radius * outwards),
           .normal = -(T_base_tube.linear() * outwards),
           .depth = depth});
}

void add_tube(const CylinderBody& body, const Pose& T_base_tube, const force::PegTubeShape& tube,
              force::Contacts& out) {
  CylinderBody there = in_frame(body, T_base_tube);
  there.rotation = upright(there.rotation);
  const Vector3d axis = there.rotation.col(2);
  const auto everywhere = [](const Vector3d&) { return true; };
  if (std::atan2(axis.head<2>().norm(), axis.z()) > most_tilted) {  // lying on the tube: as on a solid one
    const CylinderBody solid{Vector3d(0, 0, -0.5 * tube.tube_depth), Eigen::Matrix3d::Identity(), tube.outer_radius,
                             0.5 * tube.tube_depth};
    add_overlaps(cylinder_contacts(there, solid, 0.0), T_base_tube, out, everywhere);
    return;
  }
  force::PegTubeShape shape = tube;
  shape.tube_depth += there.reach();  // its end is no face that a pellet on the floor may touch
  shape.peg_radius = body.radius;
  shape.peg_length = 2 * body.half;
  Pose T_tube_peg(there.rotation);
  T_tube_peg.translation() = there.centre - there.half * axis;
  for (force::ContactPoint c : force::peg_tube_contacts(shape, T_tube_peg)) {
    c.point = T_base_tube * c.point;
    c.normal = T_base_tube.linear() * c.normal;
    out.add(c);
  }
  if (there.centre.head<2>().norm() >= tube.inner_radius) return;
  add_upper_rim(there, T_base_tube, tube.inner_radius, out);
  add_overlaps(plane_contacts(there, {Vector3d::UnitZ(), -tube.tube_depth}, 0.0), T_base_tube, out, everywhere);
}

}  // namespace

CylinderBody cylinder_of(const Pose& T_base_pellet, double radius, double height) {
  return {T_base_pellet.translation(), T_base_pellet.linear(), radius, 0.5 * height};
}

bool CellSolids::in_bin(const CylinderBody& body) const {
  const CylinderBody there = in_frame(body, bin.T_base_bin);
  return over_plate(there.centre, bin.size.head<2>()) && there.centre.z() > -plate_depth &&
         lowest(there) < bin.size.z();
}

double CellSolids::depth_in(int number, const CylinderBody& body) const {
  const CylinderBody there = in_frame(body, T_base_tubes[static_cast<std::size_t>(number)]);
  return body.half * std::abs(there.rotation(2, 2)) - there.centre.z();
}

int CellSolids::tube_around(const CylinderBody& body) const {
  const double play = tube.inner_radius - body.radius + soft;
  for (int i = 0; i < static_cast<int>(T_base_tubes.size()); ++i) {
    const CylinderBody there = in_frame(body, T_base_tubes[static_cast<std::size_t>(i)]);
    const Vector3d half = there.half * upright(there.rotation).col(2);
    const Vector3d lower = there.centre - half, upper = there.centre + half;
    // With its middle below the face it is nowhere else, however far it is pressed into wall or floor for an instant.
    const bool deep = there.centre.z() < 0.0 && there.centre.z() > -tube.tube_depth;
    if (deep && there.centre.head<2>().norm() < tube.inner_radius) return i;
    if (lower.z() >= 0.0 || lower.z() < -tube.tube_depth - soft) continue;
    // Of the axis that part which is below the face.
    const double share = upper.z() > 0.0 ? lower.z() / (lower.z() - upper.z()) : 1.0;
    const Vector3d end = lower + share * (upper - lower);
    if (std::max(lower.head<2>().norm(), end.head<2>().norm()) < play) return i;
  }
  return -1;
}

bool CellSolids::on_stand(const CylinderBody& body, double margin) const {
  const CylinderBody there = in_frame(body, stand.T_base_stand);
  return over_plate(there.centre, stand.size) && there.centre.z() > -plate_depth && lowest(there) < margin;
}

bool CellSolids::near(const CylinderBody& body, int number, double margin) const {
  const double reach = body.reach() + margin;
  const CylinderBody by_stand = in_frame(body, stand.T_base_stand);
  const Eigen::Vector2d wider = stand.size.array() + 2 * reach;
  if (over_plate(by_stand.centre, wider) && by_stand.centre.z() > -reach && lowest(by_stand) < margin) return true;
  for (const Pose& T_base_tube : T_base_tubes) {
    const CylinderBody by_tube = in_frame(body, T_base_tube);
    if (by_tube.centre.head<2>().norm() < tube.outer_radius + reach && lowest(by_tube) < margin &&
        by_tube.centre.z() > -tube.tube_depth - reach)
      return true;
  }
  CylinderBody raised = body;
  raised.centre -= margin * bin.T_base_bin.linear().col(2);
  if (in_bin(raised)) return true;
  return std::any_of(pellets.begin(), pellets.end(), [&](const RestingPellet& other) {
    return other.number != number && (other.body.centre - body.centre).norm() < other.body.reach() + reach;
  });
}

force::Contacts CellSolids::contacts(const CylinderBody& body, int number) const {
  force::Contacts out;
  add_stand(body, stand, out);
  for (const Pose& T_base_tube : T_base_tubes)
    if ((T_base_tube.inverse() * body.centre).head<2>().norm() < tube.outer_radius + body.reach())
      add_tube(body, T_base_tube, tube, out);
  if (in_bin(body)) add_bin(body, bin, out);
  for (const RestingPellet& other : pellets)
    if (other.number != number)
      add_overlaps(cylinder_contacts(body, other.body, 0.0), Pose::Identity(), out,
                   [](const Vector3d&) { return true; });
  return out;
}

CylinderBody PelletSurroundings::body(const Pose& T_base_peg) const {
  return {T_base_peg * Vector3d(0, 0, 0.5 * height_), T_base_peg.linear(), radius_, 0.5 * height_};
}

bool PelletSurroundings::clear(const Pose& T_base_peg) const {
  return !solids_->near(body(T_base_peg), number_, clear_gap);
}

force::Contacts PelletSurroundings::contacts(const Pose& T_base_peg) const {
  return solids_->contacts(body(T_base_peg), number_);
}

}  // namespace kr5::sim
