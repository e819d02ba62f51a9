// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/arm_links.hpp>

#include <algorithm>
#include <cmath>
#include <sstream>

#include <kr5/core/error.hpp>

#include "cell/check/diagnostic_collector.hpp"
#include "cell/dh_frames.hpp"

namespace kr5::cell {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using kinematics::DhJoint;

/// Value of a joint, or `otherwise` where the list does not have it.
double of_joint(const VectorXd& values, Index i, double otherwise) { return i < values.size() ? values[i] : otherwise; }

void copy_limits(const Limits& limits, Index i, ArmLink& link) {
  link.lower = of_joint(limits.lower, i, link.lower);
  link.upper = of_joint(limits.upper, i, link.upper);
  link.velocity = of_joint(limits.velocity, i, link.velocity);
  link.effort = of_joint(limits.effort, i, link.effort);
}

void copy_drive(const Drives& drives, Index i, ArmLink& link) {
  link.viscous = of_joint(drives.friction.viscous, i, 0.0);
  link.coulomb = of_joint(drives.friction.coulomb, i, 0.0);
  if (drives.structure.rows() == drives.rotor_inertia.size() && i < drives.structure.cols())
    link.armature = drives.structure.col(i).cwiseAbs2().dot(drives.rotor_inertia);
}

VectorXd each(const ArmLinks& arm, double ArmLink::*member) {
  VectorXd out(static_cast<Index>(arm.links.size()));
  for (Index i = 0; i < out.size(); ++i) out[i] = arm.links[static_cast<std::size_t>(i)].*member;
  return out;
}

void put_chain(const ArmLinks& arm, Cell& cell) {
  std::vector<JointAxis> axes;
  for (const ArmLink& link : arm.links) {
    const Pose& T = link.T_base_link;
    axes.push_back({link.type, T.translation(), T.linear().col(2), T.linear().col(0)});
  }
  const DhFrames frames = dh_frames(axes, arm.T_base_tip);
  cell.robot.T_base_0 = frames.chain.T_base_0;
  cell.robot.dh = frames.chain.joints;
  if (frames.T_flange_tip.translation().isZero(0.0)) return;
  cell.tool = Tool{};
  cell.tool->T_flange_tool = frames.T_flange_tip;
}

void put_bodies(const ArmLinks& arm, Cell& cell) {
  if (std::all_of(arm.links.begin(), arm.links.end(), [](const ArmLink& link) { return link.body.mass == 0.0; }))
    return;
  const std::vector<Pose> T = nominal_chain(cell).link_poses(VectorXd::Zero(static_cast<Index>(arm.links.size())));
  for (std::size_t i = 0; i < T.size(); ++i)
    cell.robot.links.push_back(transformed_body(T[i].inverse() * arm.links[i].T_base_link, arm.links[i].body));
}

constexpr double endless_velocity = 1e3, endless_effort = 1e6;  // [rad/s or m/s], [N m or N]

/// Whether a joint has a range of values: exporters write 0 and 0, crossed or huge limits where they know none.
bool has_range(const ArmLink& link) {
  const double most = link.type == kinematics::JointType::Prismatic ? 2 * long_arm : many_turns;
  return link.lower < link.upper && std::max(std::abs(link.lower), std::abs(link.upper)) <= most;
}

void put_limits(const ArmLinks& arm, Cell& cell) {
  Limits limits{each(arm, &ArmLink::lower), each(arm, &ArmLink::upper), each(arm, &ArmLink::velocity),
                each(arm, &ArmLink::effort)};
  for (std::size_t i = 0; i < arm.links.size(); ++i) {
    if (has_range(arm.links[i])) continue;
    limits.lower[static_cast<Index>(i)] = -INFINITY;
    limits.upper[static_cast<Index>(i)] = INFINITY;
  }
  limits.velocity = (limits.velocity.array() > endless_velocity).select(INFINITY, limits.velocity);
  limits.effort = (limits.effort.array() > endless_effort).select(INFINITY, limits.effort);
  const auto none = [](const VectorXd& v) { return (v.array().abs() == INFINITY).all(); };
  if (none(limits.velocity)) limits.velocity.resize(0);
  if (none(limits.effort)) limits.effort.resize(0);
  if (!(none(limits.lower) && none(limits.upper) && !limits.velocity.size() && !limits.effort.size()))
    cell.robot.limits = limits;
}

void put_drives(const ArmLinks& arm, Cell& cell) {
  Drives drives = unit_drives(cell.robot.joints());
  drives.friction = {each(arm, &ArmLink::coulomb), each(arm, &ArmLink::viscous)};
  drives.rotor_inertia = each(arm, &ArmLink::armature);
  if (!drives.friction.coulomb.isZero(0.0) || !drives.friction.viscous.isZero(0.0) || !drives.rotor_inertia.isZero(0.0))
    cell.drives = drives;
}

}  // namespace

bool arm_ends_before(int joints, int behind) {
  constexpr int shortest_arm = 4;
  return joints > 0 && (behind == 0 || (joints >= shortest_arm && behind < joints));
}

std::vector<std::string> joints_without_range(const ArmLinks& arm) {
  std::vector<std::string> out;
  for (const ArmLink& link : arm.links)
    if (!has_range(link) && (std::isfinite(link.lower) || std::isfinite(link.upper))) out.push_back(link.joint);
  return out;
}

ArmLinks arm_links(const Cell& cell) {
  ArmLinks out;
  Pose T = cell.robot.T_base_0;  // of the DH frame before joint i
  for (std::size_t i = 0; i < cell.robot.dh.size(); ++i) {
    const DhJoint& row = cell.robot.dh[i];
    const auto index = static_cast<Index>(i);
    ArmLink& link = out.links.emplace_back();
    link.joint = cell.robot.joint_names.empty() ? "joint_" + std::to_string(i + 1) : cell.robot.joint_names.at(i);
    link.type = row.type;
    link.T_base_link = T * Eigen::AngleAxisd(row.theta_offset, Eigen::Vector3d::UnitZ());
    DhJoint rest = row;
    rest.theta_offset = 0.0;
    const Pose T_link_dh = rest.transform(0.0);
    if (i < cell.robot.links.size()) link.body = transformed_body(T_link_dh, cell.robot.links[i]);
    if (cell.robot.limits) copy_limits(*cell.robot.limits, index, link);
    if (cell.drives) copy_drive(*cell.drives, index, link);
    T = link.T_base_link * T_link_dh;
  }
  out.T_base_tip = T;
  return out;
}

namespace {

/// Length of the way along the arm, from axis to axis [m].
double reach_of(const ArmLinks& arm) {
  double reach = 0.0;
  for (std::size_t i = 1; i < arm.links.size(); ++i)
    reach += (arm.links[i].T_base_link.translation() - arm.links[i - 1].T_base_link.translation()).norm();
  return reach + (arm.T_base_tip.translation() - arm.links.back().T_base_link.translation()).norm();
}

/// The place of the axis of a slide means nothing.
bool slides(const ArmLink& link) { return link.type == kinematics::JointType::Prismatic; }

void require_near_axes(const ArmLinks& before, const ArmLinks& after) {
  constexpr double part = 0.1, shortest = 0.1, turned = 0.2;  // of the reach; [m]; [rad]
  const double most = part * std::max(reach_of(before), shortest);
  for (std::size_t i = 0; i < before.links.size(); ++i) {
    const Pose T = before.links[i].T_base_link.inverse() * after.links[i].T_base_link;
    const double beside = slides(after.links[i]) ? 0.0 : T.translation().head<2>().norm(),
                 angle = std::acos(std::clamp(T(2, 2), -1.0, 1.0));
    if (beside <= most && angle <= turned) continue;
    std::ostringstream found;
    found.precision(2);
    found << beside << " m beside that of the cell and is turned against it by " << angle << " rad";
    throw InvalidArgument("the axis of " + before.links[i].joint + " lies " + found.str());
  }
}

}  // namespace

std::vector<Pose> link_displacements(const ArmLinks& before, const ArmLinks& after) {
  constexpr double slid = 0.05, turned = 0.2;  // [m], [rad]
  const std::size_t found = before.links.size(), expected = after.links.size();
  require(found == expected, "found " + std::to_string(found) + (found == 1 ? " joint" : " joints") +
                                 ", and the cell has " + std::to_string(expected));
  require(!before.links.empty(), "links: found none, expected at least one joint");
  require_near_axes(before, after);
  std::vector<Pose> out;
  for (std::size_t i = 0; i < before.links.size(); ++i) {
    Pose reference = before.links[i].T_base_link;
    const Pose& now = after.links[i].T_base_link;
    const Pose T = reference.inverse() * now;
    Eigen::Vector3d slide = T.translation();
    if (!slides(after.links[i])) slide.head<2>().setZero();
    const double turn = std::atan2(T(1, 0) - T(0, 1), T(0, 0) + T(1, 1));
    if (slide.norm() > slid || std::abs(turn) > turned)
      reference = reference * Eigen::Translation3d(slide) * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ());
    out.push_back(now * reference.inverse());
  }
  return out;
}

Cell cell_of_links(const ArmLinks& arm) {
  require(!arm.links.empty(), "links: an arm has at least one");
  Cell out;
  put_chain(arm, out);
  for (const ArmLink& link : arm.links) out.robot.joint_names.push_back(link.joint);
  put_bodies(arm, out);
  put_limits(arm, out);
  put_drives(arm, out);
  return out;
}

}  // namespace kr5::cell
