// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/static_kinds.hpp>

#include <cmath>
#include <limits>
#include <unordered_map>

#include <kr5/physics/camera.hpp>
#include <kr5/physics/scanner.hpp>
#include <kr5/physics/tool.hpp>
#include <kr5/predict/cell_objects.hpp>

#include "predict/posture_sequence.hpp"

namespace kr5::predict {

using Eigen::Index;
using Eigen::Vector3d;

PredictionTable predict_poses(const cell::Cell& cell, const ExperimentInput& input, const FlangeAtRest& flange) {
  const Pose T_flange_tool = physics::tool_offset(cell);
  PostureSequence postures(input, flange);
  Eigen::MatrixXd poses(input.rows(), 7);
  for (Index k = 0; k < input.rows(); ++k) {
    const Pose T_base_tool = postures.T_base_flange(k) * T_flange_tool;
    Eigen::Quaterniond r(T_base_tool.linear());
    if (r.w() < 0) r.coeffs() *= -1;
    poses.row(k) << T_base_tool.translation().transpose(), r.w(), r.x(), r.y(), r.z();
  }
  PredictionTable out(input.rows());
  Index column = 0;
  for (const char* name : {"x", "y", "z", "qw", "qx", "qy", "qz"}) out.add(name, poses.col(column++));
  return out;
}

namespace {

/// Points of the target that the camera looks at, in the target, by the number of the marker (or point) and corner.
class ViewedPoints {
 public:
  ViewedPoints(const cell::Cell& cell, const ExperimentInput& input)
      : input_(input), target_(cell_targets(cell).front()), all_(target_points(target_)) {
    for (std::size_t i = 0; i < all_.ids.size(); ++i) place_[all_.ids[i]] = static_cast<Index>(i);
  }

  const cell::Target& target() const { return target_; }

  Vector3d operator()(int marker, int corner) const {
    const bool points = target_.kind == TargetKind::Chessboard || target_.kind == TargetKind::CircleGrid ||
                        target_.kind == TargetKind::Charuco;
    const auto found = place_.find(points ? marker : 4 * marker + corner);
    if (found == place_.end() || corner < 0 || corner > 3)
      input_.fail("the target '" + target_.name + "' has no marker " + std::to_string(marker) + " with a corner " +
                  std::to_string(corner));
    return all_.points.col(found->second);
  }

 private:
  const ExperimentInput& input_;
  cell::Target target_;
  TargetPoints all_;
  std::unordered_map<int, Index> place_;
};

}  // namespace

PredictionTable predict_views(const cell::Cell& cell, const ExperimentInput& input, const FlangeAtRest& flange) {
  input.need(cell.camera.has_value(), "camera");
  input.need(cell.board || !cell.targets.empty(), "board");
  const physics::EffectiveCamera camera(cell);
  const ViewedPoints points(cell, input);
  const cell::Target& target = points.target();
  input.need(target.T_base_target || target.T_flange_target, "board.T_B_W");
  const auto marker = input["marker"], corner = input["corner"];
  PostureSequence postures(input, flange);
  Eigen::VectorXd u(input.rows()), v(input.rows());
  for (Index k = 0; k < input.rows(); ++k) {
    const Pose& T_base_flange = postures.T_base_flange(k);
    const Vector3d p = points(static_cast<int>(std::lround(marker[k])), static_cast<int>(std::lround(corner[k])));
    const Vector3d in_base =
        target.T_base_target ? *target.T_base_target * p : T_base_flange * (*target.T_flange_target * p);
    const Vector3d seen = camera.T_base_camera(T_base_flange).inverse() * in_base;
    u[k] = v[k] = std::numeric_limits<double>::quiet_NaN();
    if (seen.z() <= 0.0) continue;
    const Eigen::Vector2d pixel = camera.lens().project(seen);
    u[k] = pixel.x(), v[k] = pixel.y();
  }
  PredictionTable out(input.rows());
  out.add("u", u);
  out.add("v", v);
  return out;
}

namespace {

struct TargetHit {
  double z = std::numeric_limits<double>::quiet_NaN();
  bool sphere = false;
};

/// First meeting of a ray with the sphere or the plane.
TargetHit hit_target(const cell::ScannerTarget& target, const Ray& ray) {
  TargetHit hit;
  if (const double z = (target.plane - ray.origin.z()) / ray.direction.z(); z > 0 && std::isfinite(z)) hit.z = z;
  Solid ball{.kind = SolidKind::Ball};
  ball.radius = target.radius;
  const RayHit met = ball.intersect({ray.origin - target.sphere, ray.direction});
  if (met.hit() && !(met.distance >= hit.z)) hit = {met.distance, true};
  return hit;
}

}  // namespace

PredictionTable predict_scan(const cell::Cell& cell, const ExperimentInput& input, const FlangeAtRest& flange) {
  input.need(cell.laser.has_value(), "laser");
  input.need(cell.laser->target.has_value(), "laser.target");
  const physics::EffectiveScanner scanner(cell);
  const auto x = input["x"], speed = input["speed"];
  PostureSequence postures(input, flange);
  Eigen::VectorXd z(input.rows()), sphere(input.rows());
  for (Index k = 0; k < input.rows(); ++k) {
    const Pose T_base_scanner = postures.T_base_flange(k) * scanner.T_flange_scanner();
    const TargetHit hit = hit_target(*cell.laser->target, scanner.laser_lag(T_base_scanner, x[k], speed[k]));
    z[k] = scanner.laser_bias(hit.z);
    sphere[k] = hit.sphere ? 1.0 : 0.0;
  }
  PredictionTable out(input.rows());
  out.add("z", z);
  out.add("sphere", sphere);
  return out;
}

}  // namespace kr5::predict
