// SPDX-License-Identifier: BSD-3-Clause
#include "cell/check/units.hpp"

#include <cmath>
#include <cstdlib>
#include <numbers>

#include <kr5/core/linear.hpp>

namespace kr5::cell {
namespace {

using io::Node;

constexpr double whole_turn = 2 * std::numbers::pi * (1 + 1e-9);
constexpr double large_part = 1.0;     // [m] markers, pegs and tubes are smaller
constexpr double heavy_link = 2000.0;  // [kg]
constexpr double heavy_tool = 500.0;   // [kg]

const char* const angle_hint = "an angle within a full turn [rad]; is it in degrees?";
const char* const length_hint = "a length in metres; is it in millimetres?";

void check_dh(const Cell& cell, DiagnosticCollector& c) {
  for (std::size_t i = 0; i < cell.robot.dh.size(); ++i) {
    const auto& row = cell.robot.dh[i];
    const std::string field = item("robot.dh", static_cast<Eigen::Index>(i));
    c.expect(std::abs(row.alpha) <= whole_turn, field + ".alpha", angle_hint);
    c.expect(std::abs(row.theta_offset) <= whole_turn, field + ".theta_offset", angle_hint);
    c.expect(std::abs(row.beta) <= whole_turn, field + ".beta", angle_hint);
    c.expect(std::abs(row.a) <= long_arm, field + ".a", length_hint);
    c.expect(std::abs(row.b) <= long_arm, field + ".b", length_hint);
  }
}

void check_joint_limits(const Cell& cell, DiagnosticCollector& c) {
  if (!cell.robot.limits) return;
  constexpr double fast = 100.0;  // [rad/s]
  const Limits& limits = *cell.robot.limits;
  for (Eigen::Index i = 0; i < limits.lower.size(); ++i) {
    const bool slides = cell.robot.dh[static_cast<std::size_t>(i)].type == kinematics::JointType::Prismatic;
    for (const auto& [name, value] : {std::pair{"lower", limits.lower[i]}, std::pair{"upper", limits.upper[i]}})
      c.expect(std::isinf(value) || std::abs(value) <= (slides ? 2 * long_arm : many_turns),
               item(std::string("robot.limits.") + name, i),
               slides ? length_hint : "a joint angle [rad]; is it in degrees?");
    if (limits.velocity.size() > 0)
      c.expect(std::isinf(limits.velocity[i]) || limits.velocity[i] <= (slides ? 2 * long_arm : fast),
               item("robot.limits.velocity", i),
               slides ? "a speed in m/s; is it in mm/s?" : "a joint speed [rad/s]; is it in deg/s?");
  }
}

void check_body(DiagnosticCollector& c, const std::string& field, double mass, double heavy, const Eigen::Vector3d& com,
                const Eigen::Matrix3d& I) {
  constexpr double wide = 3.0;  // [m] radius of gyration
  c.expect(!(mass > heavy), field + ".mass", "a mass in kilograms; is it in grams?");
  c.expect(com.cwiseAbs().maxCoeff() <= long_arm, field + ".com", "a centre of mass in metres; is it in millimetres?");
  constexpr double slack = 1e-3;  // printed inertias are rounded
  const Eigen::Vector3d l = symmetric_eigen(I).values;
  // A model that was identified may have such links, and still predict what their sums move.
  c.expect(l[0] >= -1e-9 * l.cwiseAbs().maxCoeff(), field + ".inertia",
           "a matrix without negative principal moments; least found " + rounded_text(l[0]) + " kg m^2");
  c.expect(l[0] <= 0 || l[0] + l[1] >= l[2] * (1 - slack), field + ".inertia",
           "principal moments of which two add up to no less than the third, as of any real body; found " +
               rounded_text(l[0]) + " + " + rounded_text(l[1]) + " < " + rounded_text(l[2]) + " kg m^2");
  if (mass > 0 && mass <= heavy)
    c.expect(I.diagonal().maxCoeff() <= mass * wide * wide, field + ".inertia",
             "moments of a body of " + text_of(mass) + " kg within 3 m [kg m^2]; are they in kg mm^2 or kg cm^2?");
}

void check_mass_units(const Cell& cell, DiagnosticCollector& c) {
  for (std::size_t i = 0; i < cell.robot.links.size(); ++i) {
    const Link& link = cell.robot.links[i];
    check_body(c, item("robot.links", static_cast<Eigen::Index>(i)), link.mass, heavy_link, link.com,
               link.inertia_matrix());
  }
  if (cell.tool) check_body(c, "tool", cell.tool->mass, heavy_tool, cell.tool->com, cell.tool->inertia_matrix());
  const double g = cell.robot.gravity.norm();
  c.expect(g == 0.0 || (g > 1.0 && g < 30.0), "robot.gravity", "about 9.81 m/s^2, or none; is it in mm/s^2 or in g?");
}

void check_parts(const Cell& cell, DiagnosticCollector& c) {
  const auto part = [&](const std::string& field, double length) {
    c.expect(std::abs(length) <= large_part, field, length_hint);
  };
  if (cell.board) {
    part("board.marker", cell.board->marker);
    part("board.gap", cell.board->gap);
  }
  for (std::size_t i = 0; i < cell.targets.size(); ++i) {
    part(item("targets", static_cast<Eigen::Index>(i)) + ".size", cell.targets[i].size);
    part(item("targets", static_cast<Eigen::Index>(i)) + ".gap", cell.targets[i].gap);
  }
  if (cell.peg) {
    part("peg.radius", cell.peg->radius);
    part("peg.length", cell.peg->length);
  }
  if (cell.tube) {
    part("tube.inner_radius", cell.tube->inner_radius);
    part("tube.outer_radius", cell.tube->outer_radius);
    part("tube.depth", cell.tube->depth);
  }
  if (cell.laser && cell.laser->target) {
    part("laser.target.radius", cell.laser->target->radius);
    c.expect(cell.laser->target->sphere.cwiseAbs().maxCoeff() <= long_arm, "laser.target.sphere", length_hint);
    c.expect(std::abs(cell.laser->target->plane) <= long_arm, "laser.target.plane", length_hint);
  }
}

void check_rest(const Cell& cell, DiagnosticCollector& c) {
  constexpr double slow_cycle = 0.5, long_delay = 2.0;  // [s]
  constexpr double soft = 200.0;                        // [N/m] softer than a rubber band
  if (const auto& servo = cell.servo) {
    c.expect(servo->cycle <= slow_cycle, "servo.cycle", "a period in seconds; is it in milliseconds?");
    for (std::size_t i = 0; i < servo->joint.size(); ++i)
      c.expect(
          servo->joint[i].delay <= long_delay,
          (servo->joint.size() == 1 ? "servo.joint" : item("servo.joint", static_cast<Eigen::Index>(i))) + ".delay",
          "a delay in seconds; is it in milliseconds?");
    for (std::size_t i = 0; i < servo->torque.size(); ++i)
      c.expect(servo->torque[i].delay <= long_delay,
               {"servo.torque", servo->torque.size() == 1 ? -1 : static_cast<Eigen::Index>(i), ".delay"},
               "a delay in seconds; is it in milliseconds?");
    if (servo->tool)
      c.expect(servo->tool->delay <= long_delay, "servo.tool.delay", "a delay in seconds; is it in milliseconds?");
  }
  if (cell.contact && cell.contact->stiffness > 0)
    c.expect(cell.contact->stiffness >= soft, "contact.stiffness", "a stiffness in N/m; is it in N/mm?");
  if (const auto& camera = cell.camera; camera && camera->fx > 0)
    c.expect(camera->fx >= 0.1 * camera->width, "camera.fx", "a focal length in pixels; is it in millimetres?");
  const Noise& n = cell.noise;
  const auto small = [&](const char* name, double value, double most, const char* hint) {
    c.expect(value <= most, std::string("noise.") + name, hint);
  };
  small("position", n.position, 0.01, "a standard deviation of a joint reading in rad; is it in degrees?");
  small("pose_position", n.pose_position, 0.02, "a standard deviation in metres; is it in millimetres?");
  small("pose_rotation", n.pose_rotation, 0.02, "a standard deviation in rad; is it in degrees?");
  small("laser", n.laser, 0.01, "a standard deviation in metres; is it in millimetres?");
  small("depth", n.depth, 0.01, "a standard deviation in metres; is it in millimetres?");
}

bool number_of(const Node& node, double& value) {
  char* end = nullptr;
  value = std::strtod(node.scalar.c_str(), &end);
  return node.kind == Node::Kind::Scalar && !node.quoted && !node.scalar.empty() && *end == '\0';
}

/// Poses by their names, whatever they belong to.
void check_tree(const Node& node, const std::string& field, const std::string& key, DiagnosticCollector& c) {
  double v = 0;
  if (key.starts_with("T_") && node.items.size() == 6)
    for (std::size_t i = 0; i < 6; ++i)
      if (number_of(node.items[i], v) && std::abs(v) > (i < 3 ? long_arm : whole_turn))
        c.add(field + "[" + std::to_string(i) + "]", i < 3 ? length_hint : angle_hint);
  if (key.starts_with("T_") && node.items.size() == 4)
    for (std::size_t i = 0; i < 3; ++i)
      if (node.items[i].items.size() == 4 && number_of(node.items[i].items[3], v) && std::abs(v) > long_arm)
        c.add(field + "[" + std::to_string(i) + "][3]", length_hint);
  for (std::size_t i = 0; i < node.items.size(); ++i)
    check_tree(node.items[i], field + "[" + std::to_string(i) + "]", "", c);
  for (const auto& [name, entry] : node.entries) check_tree(entry, io::Reader::join(field, name), name, c);
}

}  // namespace

void check_units(const Cell& cell, const Node& root, DiagnosticCollector& c) {
  check_dh(cell, c);
  check_joint_limits(cell, c);
  check_mass_units(cell, c);
  check_parts(cell, c);
  check_rest(cell, c);
  check_tree(root, "", "", c);
}

}  // namespace kr5::cell
