// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/cell_objects.hpp>

#include <kr5/physics/tube.hpp>

namespace kr5::predict {
namespace {

cell::PlacedObject target_sphere(const cell::ScannerTarget& target) {
  cell::PlacedObject out;
  out.kind = SolidKind::Ball;
  out.name = "sphere";
  out.radius = target.radius;
  out.T_base_object.translation() = target.sphere;
  return out;
}

/// The printed points of a flat target, as a plate.
cell::PlacedObject target_plate(const cell::Target& target) {
  const Eigen::Matrix3Xd points = target_points(target).points;
  const Eigen::Vector3d low = points.rowwise().minCoeff(), high = points.rowwise().maxCoeff();
  cell::PlacedObject out;
  out.kind = SolidKind::Plate;
  out.name = target.name;
  out.width = high.x() - low.x();
  out.height = high.y() - low.y();
  out.T_base_object = *target.T_base_target * Eigen::Translation3d((low + high) / 2);
  return out;
}

}  // namespace

std::vector<cell::Target> cell_targets(const cell::Cell& cell) {
  std::vector<cell::Target> out = cell.targets;
  if (!cell.board) return out;
  out.insert(out.begin(), cell.board->target());
  out.front().name = "board";
  return out;
}

std::vector<cell::PlacedObject> cell_solids(const cell::Cell& cell) {
  std::vector<cell::PlacedObject> out;
  if (cell.tube) out.push_back(physics::tube_object(cell));
  if (cell.laser && cell.laser->target) out.push_back(target_sphere(*cell.laser->target));
  return out;
}

std::vector<cell::PlacedObject> scanner_objects(const cell::Cell& cell) {
  std::vector<cell::PlacedObject> out;
  if (cell.tube) out.push_back(physics::tube_object(cell));
  for (const cell::Target& target : cell_targets(cell))
    if (target.T_base_target && target.kind != TargetKind::MarkerMap) out.push_back(target_plate(target));
  if (!cell.laser || !cell.laser->target) return out;
  out.push_back(target_sphere(*cell.laser->target));
  out.push_back(wide_plate("plane", cell.laser->target->plane));
  return out;
}

cell::PlacedObject wide_plate(const std::string& name, double height) {
  cell::PlacedObject out;
  out.kind = SolidKind::Plate;
  out.name = name;
  out.width = out.height = 20.0;
  out.T_base_object.translation().z() = height;
  return out;
}

}  // namespace kr5::predict
