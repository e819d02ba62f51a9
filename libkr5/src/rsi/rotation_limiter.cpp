// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/rotation_limiter.hpp>

#include <kr5/geometry/pose.hpp>

namespace kr5::rsi {
namespace {

constexpr double endless = 1e6;  // total of a component that never ends [rad]
constexpr double unseen = 1e-9;  // below what a telegram shows [rad]

MotionLimiter component(MotionLimits limits, double cycle) {
  limits.total = endless;
  return {limits, cycle};
}

}  // namespace

RotationLimiter::RotationLimiter(const MotionLimits& limits, double cycle)
    : limiters_{component(limits, cycle), component(limits, cycle), component(limits, cycle)} {}

/// What the components went in this cycle becomes a rotation, and they count from there.
bool RotationLimiter::turn(const Eigen::Vector3d& wanted) noexcept {
  Eigen::Vector3d gone;
  for (int i = 0; i < 3; ++i) gone[i] = limiters_[static_cast<std::size_t>(i)].value();
  value_ = nearest_rotation(exp_rotation(gone) * value_);
  const Eigen::Vector3d ahead = log_rotation(demand_ * value_.transpose());
  for (int i = 0; i < 3; ++i) limiters_[static_cast<std::size_t>(i)].recount(ahead[i]);
  return (gone - wanted).cwiseAbs().maxCoeff() < unseen;
}

bool RotationLimiter::follow(const Eigen::Matrix3d& demand) noexcept {
  const Eigen::Vector3d wanted = log_rotation(demand * value_.transpose());
  for (int i = 0; i < 3; ++i) limiters_[static_cast<std::size_t>(i)].follow(wanted[i]);
  demand_ = demand;
  return turn(wanted);
}

bool RotationLimiter::move(const Eigen::Matrix3d& demand) noexcept {
  const Eigen::Vector3d wanted = log_rotation(demand * value_.transpose());
  Eigen::Vector3d gone;
  for (int i = 0; i < 3; ++i) gone[i] = limiters_[static_cast<std::size_t>(i)].move(wanted[i]);
  demand_ = exp_rotation(gone) * value_;
  return turn(wanted);
}

void RotationLimiter::brake() noexcept {
  Eigen::Vector3d gone;
  for (int i = 0; i < 3; ++i) gone[i] = limiters_[static_cast<std::size_t>(i)].brake();
  demand_ = exp_rotation(gone) * value_;
  turn(gone);
}

void RotationLimiter::stand(const Eigen::Matrix3d& value) noexcept {
  const bool usable = value.allFinite() && is_rotation(value);
  value_ = demand_ = usable ? value : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  for (MotionLimiter& limiter : limiters_) limiter.stand(0.0);
}

}  // namespace kr5::rsi
