// SPDX-License-Identifier: BSD-3-Clause
#include "cell/urdf/model.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>

#include <pugixml.hpp>

#include <kr5/core/error.hpp>

namespace kr5::cell {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr std::array known_types = {"revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical"};

/// Reads one file; every complaint names the element it is about.
class UrdfReader {
 public:
  explicit UrdfReader(UrdfModel& model) : model_(model) {}

  void read(const pugi::xml_node& robot) {
    model_.name = robot.attribute("name").as_string("robot");
    for (const pugi::xml_node& node : robot.children()) {
      if (std::string_view(node.name()).starts_with("xacro:"))
        model_.fail("found <" + std::string(node.name()) +
                    ">: this is a xacro file; run `xacro FILE > robot.urdf` first");
      if (std::string_view(node.name()) == "link") link(node);
      if (std::string_view(node.name()) == "joint") joint(node);
    }
    if (model_.links.empty()) model_.fail("the robot has no links");
    for (const UrdfJoint& j : model_.joints) connected(j);
  }

 private:
  std::string name_of(const pugi::xml_node& node) {
    const std::string name = node.attribute("name").as_string();
    if (name.empty()) model_.fail("a <" + std::string(node.name()) + "> has no name");
    return "<" + std::string(node.name()) + " name=\"" + name + "\">";
  }

  double number(std::string_view text, const std::string& where) {
    constexpr double most = 1e40;  // moments of what is larger overflow
    if (text.starts_with('+')) text.remove_prefix(1);
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(std::abs(value) < most))
      model_.fail(where + ": found \"" + std::string(text) + "\", expected a number" +
                  (text.find('$') != text.npos ? "; run the file through xacro first" : ""));
    return value;
  }

  double number(const pugi::xml_node& node, const char* key, const std::string& where, double otherwise) {
    const pugi::xml_attribute attribute = node.attribute(key);
    if (!attribute) return otherwise;
    std::istringstream words(attribute.as_string());
    std::string word;
    words >> word;
    return number(word, where + " " + key);
  }

  Eigen::Vector3d vector(const pugi::xml_node& node, const char* key, const std::string& where,
                         const Eigen::Vector3d& otherwise) {
    const pugi::xml_attribute attribute = node.attribute(key);
    if (!attribute) return otherwise;
    std::istringstream words(attribute.as_string());
    std::vector<double> values;
    for (std::string word; words >> word;) values.push_back(number(word, where + " " + key));
    if (values.size() != 3)
      model_.fail(where + " " + key + ": found \"" + attribute.as_string() + "\", expected three numbers");
    return {values[0], values[1], values[2]};
  }

  Pose origin(const pugi::xml_node& node, const std::string& where) {
    const pugi::xml_node at = node.child("origin");
    const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
    const Eigen::Vector3d xyz = vector(at, "xyz", where, zero), rpy = vector(at, "rpy", where, zero);
    return from_xyzrpy((Vector6() << xyz, rpy).finished());
  }

  void link(const pugi::xml_node& node) {
    const std::string where = name_of(node);
    kinematics::Body body;
    if (const pugi::xml_node inertial = node.child("inertial")) {
      const pugi::xml_node I = inertial.child("inertia");
      body.mass = number(inertial.child("mass"), "value", where + " mass", 0.0);
      constexpr std::array<const char*, 6> keys = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};
      for (std::size_t i = 0; i < keys.size(); ++i)
        body.inertia[static_cast<Eigen::Index>(i)] = number(I, keys[i], where, 0.0);
      body = transformed_body(origin(inertial, where), body);
    }
    if (!model_.links.emplace(node.attribute("name").as_string(), body).second)
      model_.fail(where + " occurs twice; link names must be unique");
  }

  void joint(const pugi::xml_node& node) {
    const std::string where = name_of(node);
    UrdfJoint j;
    j.name = node.attribute("name").as_string();
    if (std::any_of(model_.joints.begin(), model_.joints.end(), [&](const UrdfJoint& k) { return k.name == j.name; }))
      model_.fail(where + " occurs twice; joint names must be unique");
    j.type = node.attribute("type").as_string();
    if (std::find(known_types.begin(), known_types.end(), j.type) == known_types.end())
      model_.fail(where + ": found type \"" + j.type +
                  "\", expected revolute, continuous, prismatic, fixed, floating or planar");
    j.parent = node.child("parent").attribute("link").as_string();
    j.child = node.child("child").attribute("link").as_string();
    j.T_parent_child = origin(node, where);
    j.axis = vector(node.child("axis"), "xyz", where + " axis", j.axis);
    if (j.axis.norm() >= 1e-6)
      j.axis.normalize();
    else
      j.axis.setZero();
    j.mimicked = node.child("mimic").attribute("joint").as_string();
    j.mimic_multiplier = number(node.child("mimic"), "multiplier", where + " mimic", 1.0);
    j.mimic_offset = number(node.child("mimic"), "offset", where + " mimic", 0.0);
    const pugi::xml_node limit = node.child("limit");
    const bool stops = limit && j.type != "continuous";
    j.lower = stops ? number(limit, "lower", where + " limit", 0.0) : -infinite;
    j.upper = stops ? number(limit, "upper", where + " limit", 0.0) : infinite;
    const auto positive = [&](const char* key) {
      const double value = number(limit, key, where + " limit", 0.0);
      return value > 0.0 ? value : infinite;
    };
    j.velocity = positive("velocity");
    j.effort = positive("effort");
    const auto not_negative = [&](const char* key) {
      const double value = number(node.child("dynamics"), key, where + " dynamics", 0.0);
      if (value < 0.0) model_.fail(where + " dynamics " + key + ": found a negative value, expected 0 or more");
      return value;
    };
    j.damping = not_negative("damping");
    j.friction = not_negative("friction");
    model_.joints.push_back(std::move(j));
  }

  void connected(const UrdfJoint& j) {
    for (const std::string& link : {j.parent, j.child})
      if (!model_.links.contains(link))
        model_.fail("joint " + j.name + ": refers to the link \"" + link + "\", which does not exist");
    if (model_.parent_of(j.child) != &j)
      model_.fail("link " + j.child + ": is the child of joints " + model_.parent_of(j.child)->name + " and " + j.name +
                  "; a closed chain is not a serial arm");
  }

  UrdfModel& model_;
};

}  // namespace

const UrdfJoint* UrdfModel::parent_of(const std::string& link) const {
  const auto found = std::find_if(joints.begin(), joints.end(), [&](const UrdfJoint& j) { return j.child == link; });
  return found == joints.end() ? nullptr : &*found;
}

std::vector<const UrdfJoint*> UrdfModel::children_of(const std::string& link) const {
  std::vector<const UrdfJoint*> found;
  for (const UrdfJoint& j : joints)
    if (j.parent == link) found.push_back(&j);
  return found;
}

void UrdfModel::fail(const std::string& what) const { throw IoError(source + ": " + what); }

UrdfModel read_urdf(std::string_view xml, const std::string& source) {
  UrdfModel model{source, {}, {}, {}};
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(xml.data(), xml.size());
  if (!parsed) {
    const auto end = xml.begin() + std::min<std::ptrdiff_t>(parsed.offset, static_cast<std::ptrdiff_t>(xml.size()));
    throw IoError(source + ":" + std::to_string(1 + std::count(xml.begin(), end, '\n')) +
                  ": is not valid XML: " + parsed.description());
  }
  const pugi::xml_node robot = document.child("robot");
  if (!robot) model.fail("found <" + std::string(document.document_element().name()) + ">, expected a URDF's <robot>");
  UrdfReader(model).read(robot);
  return model;
}

}  // namespace kr5::cell
