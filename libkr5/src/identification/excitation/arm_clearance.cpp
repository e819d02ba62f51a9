// SPDX-License-Identifier: BSD-3-Clause
#include "identification/excitation/arm_clearance.hpp"

#include <algorithm>
#include <cmath>

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

bool slides(const kinematics::DhJoint& joint) { return joint.type == kinematics::JointType::Prismatic; }

/// Of the farther end of a segment from the z axis of a frame; no point between is farther.
double axis_distance(const LineSegment& segment, const Pose& T_base_frame) {
  const Vector3d origin = T_base_frame.translation(), z = T_base_frame.linear().col(2);
  return std::max((segment.from - origin).cross(z).norm(), (segment.to - origin).cross(z).norm());
}

double link_radius(const VectorXd& radii, int link) { return radii[std::min<Index>(link, radii.size() - 1)]; }

}  // namespace

VectorXd ArmClearance::reaches() const {
  double length = options_.points.size() > 0 ? options_.points.colwise().norm().maxCoeff() : 0.0;
  const auto n = static_cast<Index>(chain_.joints.size());
  VectorXd out(n);
  for (Index j = n - 1; j >= 0; --j) {
    const kinematics::DhJoint& joint = chain_.joints[static_cast<std::size_t>(j)];
    const double stroke = slides(joint) ? std::max(std::abs(limits_.lower[j]), std::abs(limits_.upper[j])) : 0.0;
    length += std::abs(joint.a) + std::abs(joint.b) + stroke;
    out[j] = length;
  }
  return out;
}

std::vector<ArmClearance::Part> ArmClearance::parts(const std::vector<Pose>& frames, const VectorXd& q) const {
  constexpr double no_length = 1e-9;
  std::vector<Part> out;
  const int n = static_cast<int>(chain_.joints.size());
  for (int j = 0; j < n; ++j) {
    const kinematics::DhJoint& joint = chain_.joints[static_cast<std::size_t>(j)];
    const Pose& before = frames[static_cast<std::size_t>(j)];
    const Vector3d end = frames[static_cast<std::size_t>(j) + 1].translation();
    const Vector3d corner = before * Vector3d(0.0, 0.0, joint.b + (slides(joint) ? q[j] : 0.0));
    const double radius = link_radius(options_.link_radii, j);
    if (j > 0 && (corner - before.translation()).norm() > no_length)
      out.push_back({j, radius, {before.translation(), corner}});
    if ((end - corner).norm() > no_length) out.push_back({j, radius, {corner, end}});
  }
  for (const auto& point : options_.points.colwise())
    out.push_back({n, link_radius(options_.link_radii, n), {frames.back().translation(), frames.back() * point}});
  return out;
}

/// A point moves by at most the sum over the joints of their ways times its distance from their axes; the distance from
/// one axis changes only by the joints behind it, so by at most what these move the point.
double ArmClearance::max_way(const Part& part, const std::vector<Pose>& frames, const VectorXd& steps,
                             const VectorXd& reach) const {
  double out = 0.0, of_joints_behind = 0.0;
  for (Index j = std::min<Index>(part.link, steps.size() - 1); j >= 0; --j) {
    const auto k = static_cast<std::size_t>(j);
    if (slides(chain_.joints[k])) {
      out += steps[j];
      of_joints_behind += steps[j];
    } else {
      out += steps[j] * std::min(axis_distance(part.segment, frames[k]) + of_joints_behind, reach[j]);
      of_joints_behind += steps[j] * reach[j];
    }
  }
  return out;
}

std::string ArmClearance::name_of_part(const Part& part) const {
  return part.link == static_cast<int>(chain_.joints.size()) ? "the tool" : "link " + std::to_string(part.link + 1);
}

NearestApproach ArmClearance::along(const JointMotion& states, double enough) const {
  NearestApproach out;
  if (options_.keep_out.empty()) return out;
  const VectorXd reach = reaches();
  const double half = states.samples() > 1 ? 0.5 * (states.t[1] - states.t[0]) : 0.0;
  for (Index k = 0; k < states.samples(); ++k) {
    const VectorXd q = states.q.row(k);
    std::vector<Pose> frames = chain_.link_poses(q);
    frames.insert(frames.begin(), chain_.T_base_0);
    const VectorXd steps = half * states.qd.row(k).transpose().cwiseAbs() + 0.5 * half * half * limits_.acceleration;
    for (const Part& part : parts(frames, q)) {
      const double taken = part.radius + max_way(part, frames, steps, reach);
      for (const KeepOut& zone : options_.keep_out) {
        const double clearance = zone.distance(part.segment) - taken;
        if (clearance < out.clearance) out = {clearance, name_of_part(part) + " to " + zone.name};
      }
    }
    if (out.clearance < enough) break;
  }
  return out;
}

}  // namespace kr5::identification
