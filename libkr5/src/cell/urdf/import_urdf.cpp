// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/import_urdf.hpp>

#include <algorithm>
#include <iterator>
#include <sstream>

#include <Eigen/Eigenvalues>

#include <kr5/cell/arm_links.hpp>
#include <kr5/core/error.hpp>
#include <kr5/io/node.hpp>

#include "cell/check/diagnostic_collector.hpp"
#include "cell/urdf/arm_path.hpp"
#include "cell/urdf/model.hpp"

namespace kr5::cell {
namespace {

using kinematics::Body;
using kinematics::JointType;

/// Body of a link whose inertia a body can have. That of a link beside the chain, which no reading of the arm depends
/// on much, is left out and the link named.
Body sound_body(const UrdfModel& model, const ArmPath& path, const std::string& link,
                std::vector<std::string>& points) {
  constexpr double micron = 1e-6;  // [m] radius of gyration that is round-off
  Body body = model.links.at(link);
  std::ostringstream found;
  if (body.mass < 0.0) {
    found << body.mass;
    model.fail("link " + link + ": found a mass of " + found.str() + " kg, expected none or a positive one");
  }
  if (body.inertia.cwiseAbs().maxCoeff() <= body.mass * micron * micron) body.inertia.setZero();
  const Eigen::Vector3d principal =
      kinematics::inertia_matrix(body.inertia).selfadjointView<Eigen::Lower>().eigenvalues();
  if (principal.minCoeff() >= -1e-12 * principal.cwiseAbs().maxCoeff()) return body;
  found << principal.transpose();
  if (path.chain.contains(link))
    model.fail("link " + link + ": the inertia is not positive, its principal moments are " + found.str() +
               " kg m^2; correct ixx ... izz of the link");
  points.push_back(link);
  body.inertia.setZero();
  return body;
}

/// Frame on the axis of a joint, its x axis on the side of that of the link.
Pose axis_frame(const UrdfJoint& joint, const Pose& T_base_link) {
  const Eigen::Vector3d z = T_base_link.linear() * joint.axis, x = T_base_link.linear().col(0);
  // Any direction that is not along the axis will do.
  const Eigen::Vector3d side = x.cross(z).norm() > 0.1 ? x : Eigen::Vector3d(T_base_link.linear().col(1));
  Pose out = T_base_link;
  out.linear().col(0) = (side - side.dot(z) * z).normalized();
  out.linear().col(1) = z.cross(out.linear().col(0));
  out.linear().col(2) = z;
  return out;
}

ArmLink link_of(const UrdfJoint& joint, const Pose& T_base_link) {
  ArmLink out;
  out.joint = joint.name;
  out.type = joint.type == "prismatic" ? JointType::Prismatic : JointType::Revolute;
  out.T_base_link = axis_frame(joint, T_base_link);
  out.lower = joint.lower;
  out.upper = joint.upper;
  out.velocity = joint.velocity;
  out.effort = joint.effort;
  out.viscous = joint.damping;
  out.coulomb = joint.friction;
  return out;
}

ArmLinks links_of(const UrdfModel& model, const ArmPath& path, std::vector<std::string>& points) {
  ArmLinks out;
  for (const UrdfJoint* joint : path.joints)
    out.links.push_back(link_of(*joint, path.links.at(joint->child).T_base_link));
  for (const auto& [name, carried] : path.links) {
    if (carried.carrier == 0 || path.of_tool.contains(name)) continue;
    const Body body = sound_body(model, path, name, points);
    ArmLink& link = out.links[carried.carrier - 1];
    link.body = merged_body(link.body, transformed_body(link.T_base_link.inverse() * carried.T_base_link, body));
  }
  out.T_base_tip = path.links.at(path.tip).T_base_link;
  return out;
}

/// Gives the cell what hangs on the flange as its tool: a force sensor there bears it.
void add_tool(Cell& cell, const UrdfModel& model, const ArmPath& path, std::vector<std::string>& points) {
  if (path.tool.empty()) return;
  if (!cell.tool) cell.tool.emplace();
  Tool& tool = *cell.tool;
  const Pose T_base_sensor = path.links.at(path.tool).T_base_link,
             T_base_flange = path.links.at(path.tip).T_base_link * tool.T_flange_tool.inverse();
  Body body;
  for (const std::string& name : path.of_tool)
    body = merged_body(body, transformed_body(T_base_sensor.inverse() * path.links.at(name).T_base_link,
                                              sound_body(model, path, name, points)));
  tool.T_flange_sensor = T_base_flange.inverse() * T_base_sensor;
  tool.mass = body.mass;
  tool.com = body.com;
  tool.inertia = body.inertia;
}

/// What was decided where the file leaves it open.
std::vector<std::string> choices_of(const ArmPath& path, const ArmLinks& arm, const std::vector<std::string>& points) {
  std::vector<std::string> out;
  if (!path.ends.empty())
    out.push_back("the arm ends at " + path.tip + ", behind which several links follow (" + listed(path.ends) +
                  "); another end is named by --tip");
  if (const std::vector<std::string> open = joints_without_range(arm); !open.empty())
    out.push_back("the limits of " + listed(open) +
                  " are no range (0 and 0, crossed or huge), so the cell has none; write them into its robot.limits");
  if (!points.empty())
    out.push_back("the inertia of " + listed(points) +
                  ", beside the chain of joints, is none that a body has, so only mass and centre count");
  return out;
}

std::vector<std::string> notes_of(const ArmPath& path, const Cell& cell) {
  std::vector<std::string> out;
  if (cell.robot.links.empty()) out.push_back("the links have no mass, so the cell has no robot.links");
  if (!path.held.empty())
    out.push_back("joints beside the arm are held at 0, their mass is added to the links that carry them: " +
                  listed(path.held));
  std::vector<std::string> rubbing;
  for (const UrdfJoint* joint : path.joints)
    if (joint->damping != 0.0 || joint->friction != 0.0) rubbing.push_back(joint->name);
  if (!rubbing.empty())
    out.push_back("damping and friction of " + listed(rubbing) +
                  " are in the drives, with gears of 1, no rotor inertia and 1 N m/A, so that a current is a "
                  "joint torque: a URDF does not describe the motors");
  return out;
}

}  // namespace

UrdfImport parse_urdf(std::string_view xml, const std::string& source, const UrdfOptions& options) {
  const UrdfModel model = read_urdf(xml, source);
  const ArmPath path = find_arm_path(model, options);
  std::vector<std::string> points;  // links that count without their inertia
  const ArmLinks arm = links_of(model, path, points);
  UrdfImport out{cell_of_links(arm), path.base, path.tip, {}, {}};
  add_tool(out.cell, model, path, points);
  out.cell.name = model.name;
  out.joints = out.cell.robot.joint_names;
  out.notes = choices_of(path, arm, points);
  std::ranges::copy(notes_of(path, out.cell), std::back_inserter(out.notes));
  return out;
}

UrdfImport import_urdf(const std::filesystem::path& file, const UrdfOptions& options) {
  return parse_urdf(io::read_text(file), file.string(), options);
}

}  // namespace kr5::cell
