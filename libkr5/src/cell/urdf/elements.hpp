// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <pugixml.hpp>

#include <kr5/geometry/pose.hpp>
#include <kr5/kinematics/body.hpp>

namespace kr5::cell {

/// Shortest text that reads back to the same double.
std::string number_text(double value);

/// Sets xyz and rpy of an <origin>.
void write_origin(pugi::xml_node& origin, const Pose& T);

/// Sets origin, mass and inertia of an <inertial>; what is not there is added.
void write_body(pugi::xml_node& inertial, const kinematics::Body& body);

/// Sets an attribute, which is added where it is not there.
void write_attribute(pugi::xml_node& node, const char* name, const std::string& value);

}  // namespace kr5::cell
