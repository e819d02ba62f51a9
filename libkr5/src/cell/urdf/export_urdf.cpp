// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/export_urdf.hpp>

#include <cmath>
#include <sstream>

#include <kr5/cell/arm_links.hpp>
#include <kr5/core/error.hpp>
#include <kr5/io/node.hpp>

#include "cell/urdf/elements.hpp"

namespace kr5::cell {
namespace {

using kinematics::Body;
using kinematics::JointType;

void add_link(pugi::xml_node& robot, const std::string& name, const Body& body) {
  pugi::xml_node link = robot.append_child("link");
  link.append_attribute("name") = name.c_str();
  if (body.mass == 0.0 && body.inertia.isZero(0.0)) return;
  pugi::xml_node inertial = link.append_child("inertial");
  write_body(inertial, body);
}

pugi::xml_node add_joint(pugi::xml_node& robot, const std::string& name, const char* type, const std::string& parent,
                         const std::string& child, const Pose& T) {
  pugi::xml_node joint = robot.append_child("joint");
  joint.append_attribute("name") = name.c_str();
  joint.append_attribute("type") = type;
  pugi::xml_node origin = joint.append_child("origin");
  write_origin(origin, T);
  joint.append_child("parent").append_attribute("link") = parent.c_str();
  joint.append_child("child").append_attribute("link") = child.c_str();
  return joint;
}

bool bounded(const ArmLink& link) { return std::isfinite(link.lower) && std::isfinite(link.upper); }

/// A URDF has 0 where a limit is not known.
std::string known(double limit) { return number_text(std::isfinite(limit) ? limit : 0.0); }

void add_motion(pugi::xml_node& joint, const ArmLink& link) {
  joint.append_child("axis").append_attribute("xyz") = "0 0 1";
  pugi::xml_node limit = joint.append_child("limit");
  if (bounded(link)) {
    limit.append_attribute("lower") = number_text(link.lower).c_str();
    limit.append_attribute("upper") = number_text(link.upper).c_str();
  }
  limit.append_attribute("effort") = known(link.effort).c_str();
  limit.append_attribute("velocity") = known(link.velocity).c_str();
  if (link.viscous == 0.0 && link.coulomb == 0.0) return;
  pugi::xml_node dynamics = joint.append_child("dynamics");
  dynamics.append_attribute("damping") = number_text(link.viscous).c_str();
  dynamics.append_attribute("friction") = number_text(link.coulomb).c_str();
}

const char* type_of(const ArmLink& link, std::size_t number) {
  if (link.type == JointType::Revolute) return bounded(link) ? "revolute" : "continuous";
  require(bounded(link),
          "joint " + std::to_string(number) + " is prismatic without limits, which a URDF requires; add robot.limits");
  return "prismatic";
}

void add_tool(pugi::xml_node& robot, const Tool& tool) {
  add_link(robot, "sensor", {tool.mass, tool.com, tool.inertia});
  add_link(robot, "tool_tip", {});
  add_joint(robot, "flange-sensor", "fixed", "flange", "sensor", tool.T_flange_sensor);
  add_joint(robot, "sensor-tool_tip", "fixed", "sensor", "tool_tip",
            tool.T_flange_sensor.inverse() * tool.T_flange_tool);
}

}  // namespace

std::string to_urdf(const Cell& cell) {
  pugi::xml_document document;
  pugi::xml_node robot = document.append_child("robot");
  robot.append_attribute("name") = cell.name.empty() ? "robot" : cell.name.c_str();
  add_link(robot, "base_link", {});
  const ArmLinks arm = arm_links(cell);
  std::string parent = "base_link";
  Pose T_base_parent = Pose::Identity();
  for (const ArmLink& link : arm.links) {
    const std::size_t number = static_cast<std::size_t>(&link - arm.links.data()) + 1;
    const std::string name = "link_" + std::to_string(number);
    add_link(robot, name, link.body);
    pugi::xml_node joint =
        add_joint(robot, link.joint, type_of(link, number), parent, name, T_base_parent.inverse() * link.T_base_link);
    add_motion(joint, link);
    parent = name;
    T_base_parent = link.T_base_link;
  }
  add_link(robot, "flange", {});
  add_joint(robot, parent + "-flange", "fixed", parent, "flange", T_base_parent.inverse() * arm.T_base_tip);
  if (cell.tool) add_tool(robot, *cell.tool);
  std::ostringstream out;
  document.save(out, "  ");
  return out.str();
}

void export_urdf(const Cell& cell, const std::filesystem::path& file) { io::write_text(file, to_urdf(cell)); }

}  // namespace kr5::cell
