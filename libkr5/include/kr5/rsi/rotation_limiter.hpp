// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include <Eigen/Core>

#include <kr5/rsi/motion_limiter.hpp>

namespace kr5::rsi {

/// A rotation that may go all the way round: speed and acceleration of its three components are limited, its angle is
/// not. Each cycle turns from where it is, so that no rotation vector is ever long. Allocates and throws nothing.
class RotationLimiter {
 public:
  /// @param limits Of the angular velocity about each axis; the total is not looked at. @param cycle [s].
  /// @throws InvalidArgument.
  RotationLimiter(const MotionLimits& limits, double cycle);

  /// A cycle towards a rotation; whether it is there.
  bool follow(const Eigen::Matrix3d& demand) noexcept;
  /// A cycle that turns from where it is to a rotation, as far as the limits allow; whether it is there.
  bool move(const Eigen::Matrix3d& demand) noexcept;
  /// A cycle of slowing down.
  void brake() noexcept;
  /// Stands there; a matrix that is no rotation is none.
  void stand(const Eigen::Matrix3d& value) noexcept;

  const Eigen::Matrix3d& value() const noexcept { return value_; }

 private:
  bool turn(const Eigen::Vector3d& wanted) noexcept;

  std::array<MotionLimiter, 3> limiters_;  ///< Each counts from where the rotation was at the end of the last cycle.
  Eigen::Matrix3d value_ = Eigen::Matrix3d::Identity(), demand_ = Eigen::Matrix3d::Identity();
};

}  // namespace kr5::rsi
