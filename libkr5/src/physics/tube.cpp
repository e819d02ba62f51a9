// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/tube.hpp>

namespace kr5::physics {

Pose tube_shift(const cell::Cell& cell) {
  return Pose(Eigen::Translation3d(Eigen::Vector3d(cell.effects.vector("tube_shift", "shift"))));
}

Pose tube_tilt(const cell::Cell& cell) {
  const Eigen::Vector2d tilt = cell.effects.vector("tube_tilt", "tilt");
  return Pose(Eigen::AngleAxisd(tilt.x(), Eigen::Vector3d::UnitX()) *
              Eigen::AngleAxisd(tilt.y(), Eigen::Vector3d::UnitY()));
}

double tube_radius(const cell::Cell& cell) {
  return cell.effects.replaced_number("tube_radius", "inner_radius").value_or(cell.tube->inner_radius);
}

Pose T_tube_actual(const cell::Cell& cell) { return tube_shift(cell) * tube_tilt(cell); }

void shift_tube(cell::Cell& cell, const Eigen::Vector3d& by) {
  cell.effects.set("tube_shift", "tube", "shift", Eigen::VectorXd(cell.effects.vector("tube_shift", "shift") + by));
}

void tilt_tube(cell::Cell& cell, const Eigen::Vector2d& by) {
  cell.effects.set("tube_tilt", "tube", "tilt", Eigen::VectorXd(cell.effects.vector("tube_tilt", "tilt") + by));
}

void widen_tube(cell::Cell& cell, double by) {
  if (const auto radius = cell.effects.replaced_number("tube_radius", "inner_radius"))
    cell.effects.set("tube_radius", "tube", "inner_radius", *radius + by);
}

force::PegTubeShape peg_tube_shape(const cell::Cell& cell) {
  const cell::Peg& peg = *cell.peg;
  const cell::Tube& tube = *cell.tube;
  return {peg.radius, peg.length, peg.chamfer, tube_radius(cell), tube.outer_radius, tube.depth, tube.chamfer};
}

cell::PlacedObject tube_object(const cell::Cell& cell) {
  cell::PlacedObject out;
  out.kind = SolidKind::Tube;
  out.name = "tube";
  out.radius = cell.tube->outer_radius;
  out.inner_radius = tube_radius(cell);
  out.depth = cell.tube->depth;
  out.T_base_object = cell.tube->T_base_tube * T_tube_actual(cell);
  return out;
}

}  // namespace kr5::physics
