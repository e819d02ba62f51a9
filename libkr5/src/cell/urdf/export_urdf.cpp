// SPDX-License-Identifier: BSD-3-Clause
#include <charconv>
#include <cmath>
#include <sstream>

#include <pugixml.hpp>

#include <kr5/cell/export_urdf.hpp>
#include <kr5/core/error.hpp>
#include <kr5/io/node.hpp>
#include <kr5/kinematics/body.hpp>

namespace kr5::cell {
namespace {

using kinematics::Body;
using kinematics::DhJoint;
using kinematics::JointType;

/// Shortest text that reads back to the same double.
std::string text(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value == 0.0 ? 0.0 : value);
  return {buffer, end};
}

std::string text(const Eigen::Vector3d& v) { return text(v[0]) + " " + text(v[1]) + " " + text(v[2]); }

/// Roll, pitch and yaw whose product is R to rounding also near the pole, where each alone is badly known.
Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& R) {
  const double yaw = std::atan2(R(1, 0), R(0, 0));
  const Eigen::Matrix3d turned = Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix() * R;
  return {std::atan2(-turned(1, 2), turned(1, 1)), std::atan2(-turned(2, 0), turned(0, 0)), yaw};
}

void add_origin(pugi::xml_node& node, const Pose& T) {
  pugi::xml_node origin = node.append_child("origin");
  origin.append_attribute("xyz") = text(T.translation()).c_str();
  origin.append_attribute("rpy") = text(roll_pitch_yaw(T.linear())).c_str();
}

void add_link(pugi::xml_node& robot, const std::string& name, const Body& body) {
  pugi::xml_node link = robot.append_child("link");
  link.append_attribute("name") = name.c_str();
  if (body.mass == 0.0 && body.inertia.isZero(0.0)) return;
  pugi::xml_node inertial = link.append_child("inertial");
  Pose at = Pose::Identity();
  at.translation() = body.com;
  add_origin(inertial, at);
  inertial.append_child("mass").append_attribute("value") = text(body.mass).c_str();
  pugi::xml_node inertia = inertial.append_child("inertia");
  int i = 0;
  for (const char* key : {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"})
    inertia.append_attribute(key) = text(body.inertia[i++]).c_str();
}

pugi::xml_node add_joint(pugi::xml_node& robot, const std::string& name, const char* type, const std::string& parent,
                         const std::string& child, const Pose& T) {
  pugi::xml_node joint = robot.append_child("joint");
  joint.append_attribute("name") = name.c_str();
  joint.append_attribute("type") = type;
  add_origin(joint, T);
  joint.append_child("parent").append_attribute("link") = parent.c_str();
  joint.append_child("child").append_attribute("link") = child.c_str();
  return joint;
}

/// A URDF has 0 where a limit is not known.
double known(const Eigen::VectorXd& v, Eigen::Index i) { return i < v.size() && std::isfinite(v[i]) ? v[i] : 0.0; }

void add_motion(pugi::xml_node& joint, const Limits& limits, Eigen::Index i, bool bounded) {
  joint.append_child("axis").append_attribute("xyz") = "0 0 1";
  pugi::xml_node limit = joint.append_child("limit");
  if (bounded) {
    limit.append_attribute("lower") = text(limits.lower[i]).c_str();
    limit.append_attribute("upper") = text(limits.upper[i]).c_str();
  }
  limit.append_attribute("effort") = text(known(limits.effort, i)).c_str();
  limit.append_attribute("velocity") = text(known(limits.velocity, i)).c_str();
}

void add_friction(pugi::xml_node& joint, const std::optional<Drives>& drives, Eigen::Index i) {
  if (!drives) return;
  const auto of_joint = [i](const Eigen::VectorXd& v) { return i < v.size() ? v[i] : 0.0; };
  const double damping = of_joint(drives->friction.viscous), friction = of_joint(drives->friction.coulomb);
  if (damping == 0.0 && friction == 0.0) return;
  pugi::xml_node dynamics = joint.append_child("dynamics");
  dynamics.append_attribute("damping") = text(damping).c_str();
  dynamics.append_attribute("friction") = text(friction).c_str();
}

const char* type_of(const DhJoint& row, bool bounded, std::size_t i) {
  if (row.type == JointType::Revolute) return bounded ? "revolute" : "continuous";
  require(bounded,
          "joint " + std::to_string(i + 1) + " is prismatic without limits, which a URDF requires; add robot.limits");
  return "prismatic";
}

void add_tool(pugi::xml_node& robot, const Tool& tool) {
  add_link(robot, "sensor", {tool.mass, tool.com, tool.inertia});
  add_link(robot, "tool_tip", {});
  add_joint(robot, "flange-sensor", "fixed", "flange", "sensor", tool.T_flange_sensor);
  add_joint(robot, "sensor-tool_tip", "fixed", "sensor", "tool_tip",
            tool.T_flange_sensor.inverse() * tool.T_flange_tool);
}

std::vector<std::string> joint_names(const Robot& robot) {
  if (!robot.joint_names.empty()) return robot.joint_names;
  std::vector<std::string> out;
  for (int i = 1; i <= robot.joints(); ++i) out.push_back("joint_" + std::to_string(i));
  return out;
}

/// Frame of a URDF link: the DH frame before its joint, turned to theta_offset. Its x axis and origin let an import
/// find the same rows.
Pose turned(const DhJoint& row) {
  return Pose(Eigen::AngleAxisd(row.theta_offset, Eigen::Vector3d::UnitZ()).toRotationMatrix());
}

}  // namespace

std::string to_urdf(const Cell& cell) {
  pugi::xml_document document;
  pugi::xml_node robot = document.append_child("robot");
  robot.append_attribute("name") = cell.name.empty() ? "robot" : cell.name.c_str();
  add_link(robot, "base_link", {});
  std::string parent = "base_link";
  const std::vector<std::string> names = joint_names(cell.robot);
  Pose T = cell.robot.T_base_0;  // of the DH frame before joint i, in the URDF link before
  for (std::size_t i = 0; i < cell.robot.dh.size(); ++i) {
    const DhJoint& row = cell.robot.dh[i];
    DhJoint rest = row;
    rest.theta_offset = 0.0;
    const Pose T_link_dh = rest.transform(0.0);
    const std::string name = "link_" + std::to_string(i + 1);
    const auto index = static_cast<Eigen::Index>(i);
    const Limits limits = cell.robot.limits.value_or(Limits{});
    const bool bounded = index < limits.lower.size() && std::isfinite(limits.lower[index]) &&
                         index < limits.upper.size() && std::isfinite(limits.upper[index]);
    Body body;
    if (i < cell.robot.links.size()) {
      const Link& link = cell.robot.links[i];
      body = transformed_body(T_link_dh, Body{link.mass, link.com, link.inertia});
    }
    add_link(robot, name, body);
    pugi::xml_node joint = add_joint(robot, names[i], type_of(row, bounded, i), parent, name, T * turned(row));
    add_motion(joint, limits, index, bounded);
    add_friction(joint, cell.drives, index);
    parent = name;
    T = T_link_dh;
  }
  add_link(robot, "flange", {});
  add_joint(robot, parent + "-flange", "fixed", parent, "flange", T);
  if (cell.tool) add_tool(robot, *cell.tool);
  std::ostringstream out;
  document.save(out, "  ");
  return out.str();
}

void export_urdf(const Cell& cell, const std::filesystem::path& file) { io::write_text(file, to_urdf(cell)); }

}  // namespace kr5::cell
