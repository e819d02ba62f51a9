// SPDX-License-Identifier: BSD-3-Clause
#include "actual_cell.hpp"

#include <algorithm>

#include <kr5/core/random.hpp>
#include <kr5/physics/contact.hpp>
#include <kr5/physics/tube.hpp>

namespace kr5::sim {
namespace {

/// Frame of a tube that lies along Y of the base and opens against it, where the cell's tube is.
Pose horizontal_tube(const Pose& T_base_tube) {
  Pose out = T_base_tube;
  out.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return out;
}

}  // namespace

cell::Cell actual_cell(const cell::Cell& given, const InsertionSetup& setup) {
  cell::Cell out = given;
  const double bore = given.peg->radius + setup.clearance, grown = bore - given.tube->inner_radius;
  out.tube->inner_radius = bore;
  out.tube->outer_radius += grown;
  physics::widen_tube(out, grown);
  if (setup.horizontal) out.tube->T_base_tube = horizontal_tube(given.tube->T_base_tube);
  Random random(setup.seed * 0x9E3779B97F4A7C15ull + 11);
  physics::shift_tube(out, {setup.offset.x(), setup.offset.y(), 0.0});
  if (!setup.noise) return out;
  const double factor = std::max(1 + random.normal(setup.stiffness_error), 0.1);
  physics::scale_contact_stiffness(out, factor);
  physics::shift_tube(out, {0.0, 0.0, random.normal(setup.face_error)});
  physics::tilt_tube(out, Eigen::Vector2d(random.normal(setup.tube_tilt), random.normal(setup.tube_tilt)));
  const auto spread = [&](double error) { return std::max(1 + random.normal(error), 0.1); };
  if (out.servo->tool) {
    out.servo->tool->natural_frequency *= spread(setup.servo_error);
    out.servo->tool->damping_ratio *= spread(setup.servo_error);
  }
  const double friction = spread(setup.friction_error);
  physics::scale_contact_friction(out, friction);
  return out;
}

}  // namespace kr5::sim
