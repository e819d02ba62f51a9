// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/kinematics/axis_chain.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>

namespace kr5::kinematics {
namespace {

using Eigen::Vector3d;

/// A number a + eps b with eps^2 = 0: of an angle and a length.
struct Dual {
  double real = 0.0;
  double dual = 0.0;
};

/// A line as a dual vector: its direction and its moment about the origin (eq. B.4).
struct DualVector {
  Vector3d real = Vector3d::UnitZ();
  Vector3d dual = Vector3d::Zero();

  static DualVector through(const Vector3d& point, const Vector3d& direction) {
    return {direction, point.cross(direction)};
  }
  Dual dot(const DualVector& other) const {
    return {real.dot(other.real), real.dot(other.dual) + dual.dot(other.real)};
  }
  DualVector cross(const DualVector& other) const {
    return {real.cross(other.real), real.cross(other.dual) + dual.cross(other.real)};
  }
  /// Of unit length: the dual part at right angles to the real one (eq. B.6-B.8).
  DualVector normalized() const {
    const double length = real.norm();
    const Vector3d unit = real / length, moment = dual / length;
    return {unit, moment - unit.dot(moment) * unit};
  }
  Vector3d nearest_to_origin() const { return real.cross(dual); }
};

/// Angle and length between two lines, about and along a third that meets both at right angles (eq. B.10-B.12).
Dual dual_angle(const DualVector& from, const DualVector& to, const DualVector& about) {
  const Dual c = from.dot(to), s = from.cross(to).dot(about);
  return {std::atan2(s.real, c.real), s.dual * c.real - c.dual * s.real};
}

/// Any unit vector at right angles to `direction`, as near to `wanted` as it can be.
Vector3d across(const Vector3d& direction, const Vector3d& wanted) {
  Vector3d out = wanted - direction.dot(wanted) * direction;
  if (out.norm() < 1e-6) out = direction.unitOrthogonal();
  return out.normalized();
}

/// One link: from the common normal before its axis to the one behind, and what of it ends in the next axis.
struct Link {
  DhJoint joint;
  DualVector normal;  ///< The x axis of its frame.
};

/// Link between the axes z and next; `before` is the previous x axis, `start` where that meets z.
Link link_between(const DualVector& z, const DualVector& next, const DualVector& before, const Vector3d& start,
                  double parallel) {
  Link out;
  const DualVector between = z.cross(next);
  const bool near_parallel = between.real.norm() < parallel;
  if (near_parallel) {
    // x through the previous foot to where the next axis meets the plane across this one (Hayati 1983).
    const Vector3d on = next.nearest_to_origin();
    const Vector3d meets = on + z.real.dot(start - on) / z.real.dot(next.real) * next.real, along = meets - start;
    const Vector3d x = along.norm() > 1e-9 ? Vector3d(along.normalized()) : across(z.real, before.real);
    out.normal = DualVector::through(start, x);
    out.joint.a = along.dot(x);
    const Vector3d y = z.real.cross(x);
    // z' = Rx(alpha) Ry(beta) z = (sin beta, -sin alpha cos beta, cos alpha cos beta) in axes x y z.
    out.joint.beta = std::asin(std::clamp(x.dot(next.real), -1.0, 1.0));
    out.joint.alpha = std::atan2(-y.dot(next.real), z.real.dot(next.real));
  } else {
    out.normal = between.normalized();
    const Dual twist = dual_angle(z, next, out.normal);
    out.joint.alpha = twist.real, out.joint.a = twist.dual;
  }
  const Dual turn = dual_angle(before, out.normal, z);
  out.joint.theta_offset = turn.real, out.joint.b = near_parallel ? 0.0 : turn.dual;
  return out;
}

}  // namespace

DhChain chain_from_axes(std::span<const AxisLine> axes, const Eigen::VectorXd& q, const Pose& T_base_flange,
                        double parallel) {
  require(!axes.empty(), "chain_from_axes: there are no axes");
  require(
      q.size() == static_cast<Eigen::Index>(axes.size()),
      "chain_from_axes: " + std::to_string(axes.size()) + " axes, but " + std::to_string(q.size()) + " joint values");
  require(parallel > 0 && parallel < 1, "chain_from_axes: parallel must lie between 0 and 1 [-]");
  for (std::size_t i = 0; i < axes.size(); ++i)
    require(axes[i].point.allFinite() && std::abs(axes[i].direction.norm() - 1) < 1e-6,
            "chain_from_axes: axis " + std::to_string(i + 1) + " has no finite point or no direction of unit length");
  DhChain chain;
  const DualVector first = DualVector::through(axes[0].point, axes[0].direction.normalized());
  Vector3d start = first.nearest_to_origin();
  const Vector3d x0 = across(first.real, Vector3d::UnitX());
  chain.T_base_0.linear() << x0, first.real.cross(x0), first.real;
  chain.T_base_0.translation() = start;
  DualVector before = DualVector::through(start, x0);
  Pose reached = chain.T_base_0;
  for (std::size_t i = 0; i + 1 < axes.size(); ++i) {
    const DualVector z = DualVector::through(axes[i].point, axes[i].direction.normalized()),
                     next = DualVector::through(axes[i + 1].point, axes[i + 1].direction.normalized());
    Link link = link_between(z, next, before, start, parallel);
    link.joint.theta_offset -= q[static_cast<Eigen::Index>(i)];
    chain.joints.push_back(link.joint);
    reached = reached * link.joint.transform(q[static_cast<Eigen::Index>(i)]);
    // The frame's own x axis, which after beta is no longer the normal's.
    start = reached.translation();
    before = DualVector::through(start, reached.linear().col(0));
  }
  // The last link ends in the flange: its z axis is a line like another, and what is left along it and about it
  // cannot be told by a Denavit-Hartenberg row.
  const DualVector z = DualVector::through(axes.back().point, axes.back().direction.normalized()),
                   end = DualVector::through(T_base_flange.translation(), T_base_flange.linear().col(2));
  Link last = link_between(z, end, before, start, parallel);
  if (z.cross(end).real.norm() < parallel) {
    // Axis and flange are near-parallel: b reaches the flange's own height.
    const double height = z.real.dot(T_base_flange.translation() - start);
    Link shifted = link_between(z, end, DualVector::through(start + height * z.real, before.real),
                                start + height * z.real, parallel);
    shifted.joint.b = height;
    last = shifted;
  }
  last.joint.theta_offset -= q[q.size() - 1];
  chain.joints.push_back(last.joint);
  return chain;
}

bool has_near_parallel_axes(const DhJoint& joint, double parallel) {
  return std::hypot(std::sin(joint.beta), std::sin(joint.alpha) * std::cos(joint.beta)) < parallel;
}

std::vector<AxisLine> axes_of(const DhChain& chain, const Eigen::VectorXd& q) {
  const std::vector<Pose> T = chain.link_poses(q);
  std::vector<AxisLine> out;
  for (std::size_t i = 0; i < T.size(); ++i) {
    const Pose& before = i == 0 ? chain.T_base_0 : T[i - 1];
    out.push_back({before.translation(), before.linear().col(2)});
  }
  return out;
}

}  // namespace kr5::kinematics
