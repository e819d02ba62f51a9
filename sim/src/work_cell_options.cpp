// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/work_cell_options.hpp>

#include <cmath>
#include <numbers>
#include <string>

#include <kr5/core/error.hpp>

namespace kr5::sim {
namespace {

void require_above_zero(double value, const char* field) {
  require(std::isfinite(value) && value > 0.0, std::string(field) + ": must be positive");
}

void require_not_negative(double value, const char* field) {
  require(std::isfinite(value) && value >= 0.0, std::string(field) + ": must not be negative");
}

void require_pose(const Pose& T, const std::string& field) {
  require(T.matrix().allFinite() && is_rotation(T.linear()), field + ": must be a rigid motion");
}

/// Validates a part, and names it in the error.
void check_part(const auto& part, const char* name) {
  try {
    part.validate();
  } catch (const InvalidArgument& error) {
    throw InvalidArgument(std::string(name) + "." + error.what());
  }
}

}  // namespace

void GripOptions::validate() const {
  require_above_zero(reach, "reach");
  require(angle > 0.0 && angle < std::numbers::pi / 2, "angle: must lie between 0 and a quarter turn [rad]");
  require_above_zero(force, "force");
  require_above_zero(torque, "torque");
  require_above_zero(slip, "slip");
  require_not_negative(closing, "closing");
  require_not_negative(position, "position");
  require_not_negative(rotation, "rotation");
}

void StandShape::validate() const {
  require_pose(T_base_stand, "T_base_stand");
  require(size.allFinite() && size.minCoeff() > 0.0, "size: must be two positive lengths [m]");
}

void WorkCellErrors::validate() const {
  require(tube_offset.allFinite(), "tube_offset: must be finite [m]");
  each_field(*this, [](const char* name, const auto& value, const char*) {
    if constexpr (std::is_same_v<std::decay_t<decltype(value)>, double>) require_not_negative(value, name);
  });
}

WorkCellErrors severe_errors() {
  return {.servo = 0.15,
          .friction = 0.3,
          .pellet_radius = 1e-5,
          .force_delay = 0.012,
          .force_gain = 0.05,
          .force_bias = 2.5,
          .force_drift = 0.025};
}

void WorkCellOptions::validate() const {
  check_part(bin, "bin");
  check_part(pour, "pour");
  check_part(pile, "pile");
  check_part(stand, "stand");
  for (std::size_t i = 0; i < further_tubes.size(); ++i)
    require_pose(further_tubes[i], "further_tubes[" + std::to_string(i) + "]");
  require_above_zero(clearance, "clearance");
  require(std::isfinite(table), "table: must be finite [m]");
  check_part(cup, "cup");
  check_part(fingers, "fingers");
  require_above_zero(finger_length, "finger_length");
  require_not_negative(lateral_stiffness, "lateral_stiffness");
  require_above_zero(angular_stiffness, "angular_stiffness");
  require_not_negative(air, "air");
  check_part(scanner, "scanner");
  check_part(errors, "errors");
}

}  // namespace kr5::sim
