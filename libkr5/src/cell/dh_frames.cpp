// SPDX-License-Identifier: BSD-3-Clause
#include "cell/dh_frames.hpp"

#include <cmath>
#include <numbers>

namespace kr5::cell {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using kinematics::DhJoint;

constexpr double negligible = 1e-14;    // [m or rad] what rounding of a file leaves of 0
constexpr double near_parallel = 0.05;  // [rad] below, a common normal lies too far away

/// Right angles that rounding has bent by a bit are right angles.
double clean_angle(double angle) {
  const double turns = std::round(angle / (std::numbers::pi / 2)) * (std::numbers::pi / 2);
  return std::abs(angle - turns) < negligible ? turns : angle;
}

double clean_length(double length) { return std::abs(length) < negligible ? 0.0 : length; }

Matrix3d about_z(double angle) { return Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix(); }

/// Of two opposite directions across z, the angle of the one on the side of `hint`.
double angle_towards(double x, double y, const Vector3d& hint) {
  const double sign = x * hint.x() + y * hint.y() < 0 ? -1.0 : 1.0;
  return clean_angle(std::atan2(sign * y, sign * x));
}

/// Frame 0: the base itself when its z axis is the first joint's, else on the axis at its height 0 or its point.
Pose first_frame(const JointAxis& axis) {
  Pose T = Pose::Identity();
  const Vector3d& d = axis.direction;
  if (d.head<2>().norm() < negligible) {
    if (d.z() < 0) T.linear() = Vector3d(1, -1, -1).asDiagonal();
    T.translation() << clean_length(axis.point.x()), clean_length(axis.point.y()), 0.0;
    return T;
  }
  const Vector3d across = std::abs(d.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  T.linear().col(0) = (across - across.dot(d) * d).normalized();
  T.linear().col(1) = d.cross(T.linear().col(0));
  T.linear().col(2) = d;
  T.translation() = axis.point;
  return T;
}

/// A row that puts z on the line through p along d; all in the frame before, in which the joint turns about z.
DhJoint row_to_line(const Vector3d& p, const Vector3d& d, const Vector3d& hint) {
  DhJoint row;
  if (d.head<2>().norm() > near_parallel) {
    row.theta_offset = angle_towards(-d.y(), d.x(), hint);
    const Vector3d along = about_z(-row.theta_offset) * d, at = about_z(-row.theta_offset) * p;
    row.a = clean_length(at.x());
    row.b = clean_length(at.z() - at.y() * along.z() / along.y());
    row.alpha = clean_angle(std::atan2(-along.y(), along.z()));
    return row;
  }
  const bool beside = p.head<2>().norm() > negligible;
  row.theta_offset = beside ? angle_towards(p.x(), p.y(), hint) : angle_towards(hint.x(), hint.y(), hint);
  const Vector3d along = about_z(-row.theta_offset) * d;
  row.a = clean_length((about_z(-row.theta_offset) * p).x());
  row.b = clean_length(p.z());
  row.beta = clean_angle(std::asin(along.x()));
  row.alpha = clean_angle(std::atan2(-along.y(), along.z()));
  return row;
}

/// The last row, to the tip T; `rest` is what it cannot reach.
DhJoint row_to_tip(const Pose& T, const Vector3d& hint, Pose& rest) {
  DhJoint row;
  const Matrix3d R = T.linear();
  const Vector3d p = T.translation();
  row.b = clean_length(p.z());
  if (p.head<2>().norm() > negligible) {
    const double theta = angle_towards(p.x(), p.y(), hint);
    const Matrix3d turned = about_z(-theta) * R;
    if (std::abs(turned(0, 1)) < negligible) {
      row.theta_offset = theta;
      row.a = clean_length((about_z(-theta) * p).x());
      row.beta = clean_angle(std::atan2(turned(0, 2), turned(0, 0)));
      row.alpha = clean_angle(std::atan2(turned(2, 1), turned(1, 1)));
      return row;
    }
    rest.translation() = R.transpose() * Vector3d(p.x(), p.y(), 0.0);
  }
  // R = Rz(theta) Rx(alpha) Ry(beta), without beta where that suffices.
  const bool plain = std::abs(R(2, 0)) < negligible;
  row.theta_offset = clean_angle(plain ? std::atan2(R(1, 0), R(0, 0)) : std::atan2(-R(0, 1), R(1, 1)));
  const Matrix3d turned = about_z(-row.theta_offset) * R;
  if (!plain) row.beta = clean_angle(std::atan2(turned(0, 2), turned(0, 0)));
  row.alpha = clean_angle(std::atan2(turned(2, 1), turned(1, 1)));
  return row;
}

}  // namespace

DhFrames dh_frames(std::span<const JointAxis> axes, const Pose& T_base_tip) {
  DhFrames out;
  Pose T = out.chain.T_base_0 = first_frame(axes.front());
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const Pose T_inverse = T.inverse();
    const Vector3d hint = T_inverse.linear() * axes[i].x;
    DhJoint row = i + 1 < axes.size()
                      ? row_to_line(T_inverse * axes[i + 1].point, T_inverse.linear() * axes[i + 1].direction, hint)
                      : row_to_tip(T_inverse * T_base_tip, hint, out.T_flange_tip);
    row.type = axes[i].type;
    T = T * row.transform(0.0);
    out.chain.joints.push_back(row);
  }
  return out;
}

}  // namespace kr5::cell
