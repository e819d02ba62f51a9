// SPDX-License-Identifier: BSD-3-Clause
#include "force/insertion/tilted_path.hpp"

#include <algorithm>
#include <cmath>

#include <kr5/robot/servo_feedforward.hpp>

namespace kr5::force {
namespace {

/// Nearest to `wanted` that is not further from `now` than `most`.
template <class V>
V reached(const V& now, const V& wanted, double most) noexcept {
  const V change = wanted - now;
  const double size = change.norm();
  return size > most ? V(now + change * (most / size)) : wanted;
}

/// From which speed one stops within `way`, a part kept back for the cycles that pass until it is told.
double braking(double way, double most, double cycle) noexcept {
  return std::min(std::sqrt(2 * 0.8 * most * way), way / (2 * cycle));
}

}  // namespace

void Axis::drive(double wanted, double most, double cycle) noexcept {
  v = std::clamp(wanted, v - most * cycle, v + most * cycle);
  x += v * cycle;
}

double Axis::towards(double target, double speed, double most, double cycle) const noexcept {
  const double way = target - x;
  return std::copysign(std::min(speed, braking(std::abs(way), most, cycle)), way);
}

void TiltedPath::rest_at(const Pose& T_tube_peg) noexcept {
  p = T_tube_peg.translation();
  v = a = Eigen::Vector3d::Zero();
  rho = tilt_of(T_tube_peg);
  rho_v = rho_a = Eigen::Vector2d::Zero();
}

void TiltedPath::stand() noexcept {
  v = a = Eigen::Vector3d::Zero();
  rho_v = rho_a = Eigen::Vector2d::Zero();
  if (!p.allFinite()) p.setZero();  // the arm stops; what it is told does not count any more
  if (!rho.allFinite()) rho.setZero();
}

void TiltedPath::drive(const Eigen::Vector3d& wanted, double most) noexcept {
  const Eigen::Vector3d next = reached(v, wanted, most * cycle);
  a = (next - v) / cycle;
  v = next;
  p += v * cycle;
}

void TiltedPath::turn(const Eigen::Vector2d& wanted, double most) noexcept {
  const Eigen::Vector2d next = reached(rho_v, wanted, most * cycle);
  rho_a = (next - rho_v) / cycle;
  rho_v = next;
  rho += rho_v * cycle;
}

void TiltedPath::turn_to(const Eigen::Vector2d& next) noexcept {
  const Eigen::Vector2d speed = (next - rho) / cycle;
  rho_a = (speed - rho_v) / cycle;
  rho_v = speed;
  rho = next;
}

Eigen::Vector3d TiltedPath::towards(const Eigen::Vector3d& target, double speed, double most) const noexcept {
  const Eigen::Vector3d way = target - p;
  const double distance = way.norm();
  if (distance < 1e-9) return Eigen::Vector3d::Zero();
  return way * (std::min(speed, braking(distance, most, cycle)) / distance);
}

Pose TiltedPath::command(double frequency, double damping) const noexcept {
  const robot::ServoFeedforward lead(frequency, damping);
  return tilted_pose(p + lead(v, a), rho + lead(rho_v, rho_a));
}

}  // namespace kr5::force
