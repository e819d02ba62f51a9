// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/geometry/tilt.hpp>
#include <kr5/robot/cycle.hpp>

namespace kr5::force {

/// One coordinate that is moved by wished speeds within a bound of acceleration.
struct Axis {
  double x = 0.0, v = 0.0;

  void drive(double wanted, double most, double cycle) noexcept;
  /// The speed at which one still stops at the target.
  double towards(double target, double speed, double most, double cycle) const noexcept;
  void rest_at(double place) noexcept { *this = {place, 0.0}; }
};

/// How the peg is wished to move: bottom centre, and tilt as the rotation vector (-sin, cos) of the azimuth times its
/// angle, so that nothing happens at an angle of zero. The peg does not spin about its own axis.
struct TiltedPath {
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero(), a = Eigen::Vector3d::Zero();
  Eigen::Vector2d rho = Eigen::Vector2d::Zero(), rho_v = Eigen::Vector2d::Zero(), rho_a = Eigen::Vector2d::Zero();
  double cycle = robot::usual_cycle;

  void rest_at(const Pose& T_tube_peg) noexcept;
  /// At rest where it is.
  void stand() noexcept;
  /// One cycle at a wished velocity.
  void drive(const Eigen::Vector3d& wanted, double most) noexcept;
  /// One cycle of tilting at a wished speed, or to where the tilt shall be after it.
  void turn(const Eigen::Vector2d& wanted, double most) noexcept;
  void turn_to(const Eigen::Vector2d& next) noexcept;
  /// The fastest velocity towards a point that still stops there.
  Eigen::Vector3d towards(const Eigen::Vector3d& target, double speed, double most) const noexcept;
  /// What a servo of second order must be told to be there: the path, led ahead by the inverse of that servo.
  Pose command(double frequency, double damping) const noexcept;
  bool finite() const noexcept { return p.allFinite() && v.allFinite() && rho.allFinite() && rho_v.allFinite(); }
};

}  // namespace kr5::force
