// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include <Eigen/Geometry>

/// @file
/// Contacts of solid cylinders with each other and with planes.

namespace kr5::sim {

struct CylinderBody {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();        ///< [m]
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< Z is the axis.
  double radius = 0.0;                                     ///< [m]
  double half = 0.0;                                       ///< Half of the height [m].

  double reach() const;  ///< Of its farthest point from the centre [m].
};

/// Points n.p >= offset are free.
struct PlaneBody {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset = 0.0;  ///< [m]
};

struct CylinderContact {
  Eigen::Vector3d point;   ///< [m]
  Eigen::Vector3d normal;  ///< Towards the first body.
  double gap = 0.0;        ///< Negative: overlap [m].
  int feature = 0;         ///< The same as long as the same parts of the bodies touch.
};

/// The contacts of one pair: few, far apart, the deepest among them.
struct ContactPatch {
  static constexpr int capacity = 6;
  std::array<CylinderContact, capacity> contacts;
  int count = 0;

  const CylinderContact* begin() const { return contacts.data(); }
  const CylinderContact* end() const { return contacts.data() + count; }
};

/// Signed distance of a point in the frame of a cylinder (origin in its middle, Z its axis) from its surface, negative
/// inside [m], and its gradient.
double cylinder_distance(const Eigen::Vector3d& point, double radius, double half, Eigen::Vector3d& gradient);

/// Places where two cylinders are closer than `margin` [m].
ContactPatch cylinder_contacts(const CylinderBody& a, const CylinderBody& b, double margin);
ContactPatch plane_contacts(const CylinderBody& a, const PlaneBody& plane, double margin);

}  // namespace kr5::sim
