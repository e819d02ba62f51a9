// SPDX-License-Identifier: BSD-3-Clause
#include "kinematics/wrist_arm.hpp"

#include <algorithm>
#include <cmath>

namespace kr5::kinematics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double wrist_small = 1e-9;  // of what must vanish, over the size of the arm

/// The point of `b` that is nearest to `a`, which is not parallel.
Vector3d nearest_on(const Axis& b, const Axis& a) {
  const Vector3d d = b.point - a.point, across = a.way.cross(b.way);
  return b.point + a.way.cross(d).dot(across) / -across.squaredNorm() * b.way;
}

Vector3d foot(const Axis& axis, const Vector3d& p) { return axis.point + axis.way.dot(p - axis.point) * axis.way; }

double distance(const Axis& axis, const Vector3d& p) { return axis.way.cross(p - axis.point).norm(); }

/// The first three joints place the wrist centre in three directions, in one posture at least.
bool places(const WristArm& arm) {
  const auto volume = [&](const Vector3d& q) { return std::abs(arm.reach(q).J.determinant()); };
  return std::max(volume({0.0, 0.7, 1.1}), volume({0.0, -1.9, 2.3})) > 1e-5;
}

}  // namespace

WristArm::Reach WristArm::reach(const Vector3d& q) const {
  const Matrix3d R1 = Eigen::AngleAxisd(q[0], axes[0].way).toRotationMatrix();
  const Matrix3d R2 = Eigen::AngleAxisd(q[1], axes[1].way).toRotationMatrix();
  const Vector3d p3 = axes[2].turned(q[2], wrist), p2 = axes[1].point + R2 * (p3 - axes[1].point);
  Reach out;
  out.wrist = axes[0].point + R1 * (p2 - axes[0].point);
  out.J << axes[0].way.cross(out.wrist - axes[0].point), R1 * axes[1].way.cross(p2 - axes[1].point),
      R1 * (R2 * axes[2].way.cross(p3 - axes[2].point));
  return out;
}

std::optional<WristArm> wrist_arm(const DhChain& chain) {
  const auto revolute = [](const DhJoint& joint) { return joint.type == JointType::Revolute; };
  if (chain.joints.size() != 6 || !std::all_of(chain.joints.begin(), chain.joints.end(), revolute)) return {};
  WristArm arm;
  arm.T_base_flange = chain.T_base_0;
  for (std::size_t i = 0; i < 6; ++i) {
    arm.axes[i] = {arm.T_base_flange.translation(), arm.T_base_flange.linear().col(2)};
    arm.T_base_flange = arm.T_base_flange * chain.joints[i].transform(0.0);
  }
  // Neighbouring axes of the wrist that are parallel could not turn it freely.
  for (const std::size_t i : {3, 4})
    if (arm.axes[i].way.cross(arm.axes[i + 1].way).norm() < 1e-3) return {};
  arm.wrist = nearest_on(arm.axes[4], arm.axes[3]);
  Vector3d from = arm.wrist;  // its path to axis 1 is the same wherever along the axes the frames of the chain lie
  arm.size = 0;
  for (const std::size_t i : {2, 1, 0}) {
    arm.axes[i].point = foot(arm.axes[i], from);
    arm.size += (from - arm.axes[i].point).norm();
    from = arm.axes[i].point;
  }
  if (!(arm.size > 0)) return {};
  for (Axis& axis : arm.axes) axis.point /= arm.size;
  arm.wrist /= arm.size;
  for (const std::size_t i : {3, 4, 5})
    if (distance(arm.axes[i], arm.wrist) > wrist_small) return {};
  if (!places(arm)) return {};
  return arm;
}

}  // namespace kr5::kinematics
