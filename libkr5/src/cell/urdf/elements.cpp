// SPDX-License-Identifier: BSD-3-Clause
#include "cell/urdf/elements.hpp"

#include <charconv>

namespace kr5::cell {
namespace {

std::string text(const Eigen::Vector3d& v) {
  return number_text(v[0]) + " " + number_text(v[1]) + " " + number_text(v[2]);
}

pugi::xml_node child(pugi::xml_node& node, const char* name) {
  const pugi::xml_node found = node.child(name);
  return found ? found : node.append_child(name);
}

}  // namespace

std::string number_text(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value == 0.0 ? 0.0 : value);
  return {buffer, end};
}

void write_attribute(pugi::xml_node& node, const char* name, const std::string& value) {
  pugi::xml_attribute attribute = node.attribute(name);
  if (!attribute) attribute = node.append_attribute(name);
  attribute = value.c_str();
}

void write_origin(pugi::xml_node& origin, const Pose& T) {
  write_attribute(origin, "xyz", text(T.translation()));
  write_attribute(origin, "rpy", text(Eigen::Vector3d(to_xyzrpy(T).tail<3>())));
}

void write_body(pugi::xml_node& inertial, const kinematics::Body& body) {
  pugi::xml_node origin = child(inertial, "origin");
  Pose T = Pose::Identity();
  T.translation() = body.com;
  write_origin(origin, T);
  pugi::xml_node mass = child(inertial, "mass"), inertia = child(inertial, "inertia");
  write_attribute(mass, "value", number_text(body.mass));
  int i = 0;
  for (const char* key : {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"})
    write_attribute(inertia, key, number_text(body.inertia[i++]));
}

}  // namespace kr5::cell
