// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/sight.hpp>

#include <kr5/core/error.hpp>
#include <kr5/predict/contact.hpp>

namespace kr5::predict {
namespace {

Pose tool_tip(const cell::Cell& cell) { return cell.tool ? cell.tool->T_F_E : Pose::Identity(); }

std::vector<cell::Target> targets_of(const cell::Cell& cell) {
  std::vector<cell::Target> out = cell.targets;
  if (!cell.board) return out;
  out.insert(out.begin(), cell.board->target());
  out.front().name = "board";
  return out;
}

cell::Thing ball(const cell::LaserTarget& target) {
  cell::Thing out;
  out.kind = SolidKind::Ball;
  out.name = "sphere";
  out.radius = target.radius;
  out.T_B_O.translation() = target.sphere;
  return out;
}

/// The printed points of a flat target, as a plate.
cell::Thing plate(const cell::Target& target) {
  const Eigen::Matrix3Xd points = target_points(target).points;
  const Eigen::Vector3d low = points.rowwise().minCoeff(), high = points.rowwise().maxCoeff();
  cell::Thing out;
  out.kind = SolidKind::Plate;
  out.name = target.name;
  out.width = high.x() - low.x();
  out.height = high.y() - low.y();
  out.T_B_O = *target.T_B_W * Eigen::Translation3d((low + high) / 2);
  return out;
}

}  // namespace

RealCamera::RealCamera(const cell::Cell& cell) {
  require(cell.camera.has_value(), "camera: the cell has none");
  const cell::SensorEffects& e = cell.effects.sensors;
  lens_ = cell.camera->pinhole();
  lens_.fx = e.fx.value_or(lens_.fx);
  lens_.fy = e.fy.value_or(lens_.fy);
  lens_.k1 = e.k1.value_or(lens_.k1);
  lens_.k2 = e.k2.value_or(lens_.k2);
  on_flange_ = cell.camera->mount == cell::CameraMount::Flange;
  require(on_flange_ || !e.T_E_C, "effects.hand_eye is for a camera on the flange, this one stands in the base");
  const std::optional<Pose> mount = on_flange_ ? cell::T_F_C(cell) : cell.camera->T_B_C;
  require(mount || e.T_E_C, on_flange_ ? "camera.T_E_C: the cell does not say where the camera sits"
                                       : "camera.T_B_C: the cell does not say where the camera stands");
  mount_ = e.T_E_C ? tool_tip(cell) * *e.T_E_C : *mount;
}

Pose real_scanner_mount(const cell::Cell& cell) {
  require(cell.laser.has_value(), "laser: the cell has none");
  if (const auto& moved = cell.effects.sensors.T_E_L) return tool_tip(cell) * *moved;
  const std::optional<Pose> T_F_L = cell::T_F_L(cell);
  require(T_F_L.has_value(), "laser.T_E_L: the cell does not say where the scanner sits");
  return *T_F_L;
}

double biased_range(const cell::SensorEffects& effects, double z) {
  constexpr double best_distance = 0.19;  // where the scanner has no bias [m]
  constexpr double bias_distance = 0.05;  // as far from there the bias is what is stated [m]
  const double off = (z - best_distance) / bias_distance;
  return z + effects.laser_bias * off * off;
}

cell::Thing real_tube_solid(const cell::Cell& cell) {
  cell::Thing out;
  out.kind = SolidKind::Tube;
  out.name = "tube";
  out.radius = cell.tube->outer_radius;
  out.inner_radius = real_inner_radius(cell);
  out.depth = cell.tube->depth;
  out.T_B_O = cell.tube->T_B_T * real_tube(cell.effects.task);
  return out;
}

Sight sight(const cell::Cell& cell, const Pose& T_B_F, const std::vector<cell::Thing>& things) {
  const RealCamera camera(cell);
  Sight out{camera.lens(), camera.at(T_B_F), {}, {}, {}};
  const Pose T_C_B = out.T_B_C.inverse();
  for (const cell::Target& target : targets_of(cell)) {
    if (!target.T_B_W && !target.T_F_W) continue;
    out.names.push_back(target.name.empty() ? "target" : target.name);
    out.targets.push_back({target, T_C_B * (target.T_B_W ? *target.T_B_W : T_B_F * *target.T_F_W)});
  }
  std::vector<cell::Thing> all;
  if (cell.tube) all.push_back(real_tube_solid(cell));
  if (cell.laser && cell.laser->target) all.push_back(ball(*cell.laser->target));
  all.insert(all.end(), things.begin(), things.end());
  for (const cell::Thing& thing : all) out.solids.push_back({thing, T_C_B * thing.T_B_O});
  return out;
}

std::vector<cell::Thing> things_of(const cell::Cell& cell) {
  std::vector<cell::Thing> out;
  if (cell.tube) out.push_back(real_tube_solid(cell));
  for (const cell::Target& target : targets_of(cell))
    if (target.T_B_W && target.kind != TargetKind::MarkerMap) out.push_back(plate(target));
  if (!cell.laser || !cell.laser->target) return out;
  out.push_back(ball(*cell.laser->target));
  out.push_back(wide_plate("plane", cell.laser->target->plane));
  return out;
}

cell::Thing wide_plate(const std::string& name, double height) {
  cell::Thing out;
  out.kind = SolidKind::Plate;
  out.name = name;
  out.width = out.height = 20.0;
  out.T_B_O.translation().z() = height;
  return out;
}

}  // namespace kr5::predict
