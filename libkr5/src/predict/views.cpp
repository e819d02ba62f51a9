// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <unordered_map>

#include <kr5/predict/sight.hpp>

#include "predict/real_arm.hpp"

namespace kr5::predict {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

/// Points of the target that the camera looks at, in the target, by the number of the marker (or point) and corner.
class Points {
 public:
  Points(const cell::Cell& cell, const Given& given)
      : given_(given), target_(cell.board ? cell.board->target() : cell.targets.front()), all_(target_points(target_)) {
    for (std::size_t i = 0; i < all_.ids.size(); ++i) place_[all_.ids[i]] = static_cast<Index>(i);
  }

  const cell::Target& target() const { return target_; }

  Vector3d operator()(int marker, int corner) const {
    const bool points = target_.kind == TargetKind::Chessboard || target_.kind == TargetKind::CircleGrid ||
                        target_.kind == TargetKind::Charuco;
    const auto found = place_.find(points ? marker : 4 * marker + corner);
    if (found == place_.end() || corner < 0 || corner > 3)
      given_.fail("the target '" + target_.name + "' has no marker " + std::to_string(marker) + " with a corner " +
                  std::to_string(corner));
    return all_.points.col(found->second);
  }

 private:
  const Given& given_;
  cell::Target target_;
  TargetPoints all_;
  std::unordered_map<int, Index> place_;
};

}  // namespace

Shown views(const cell::Cell& cell, const Given& given, const FlangeAt& flange) {
  given.need(cell.camera.has_value(), "camera");
  given.need(cell.board || !cell.targets.empty(), "board");
  const RealCamera camera(cell);
  const Points points(cell, given);
  const cell::Target& target = points.target();
  given.need(target.T_B_W || target.T_F_W, "board.T_B_W");
  const auto marker = given["marker"], corner = given["corner"];
  Postures postures(given, flange);
  Eigen::VectorXd u(given.rows()), v(given.rows());
  for (Index k = 0; k < given.rows(); ++k) {
    const Pose& T_B_F = postures.flange(k);
    const Vector3d p = points(static_cast<int>(std::lround(marker[k])), static_cast<int>(std::lround(corner[k])));
    const Vector3d in_base = target.T_B_W ? *target.T_B_W * p : T_B_F * (*target.T_F_W * p);
    const Vector3d seen = camera.at(T_B_F).inverse() * in_base;
    u[k] = v[k] = std::numeric_limits<double>::quiet_NaN();
    if (seen.z() <= 0.0) continue;
    const Eigen::Vector2d pixel = camera.lens().project(seen);
    u[k] = pixel.x(), v[k] = pixel.y();
  }
  Shown out(given.rows());
  out.add("u", u);
  out.add("v", v);
  return out;
}

}  // namespace kr5::predict
