// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/sensors.hpp>

#include <cmath>
#include <numbers>

#include <Eigen/LU>

#include <kr5/core/error.hpp>

namespace kr5::sim {
namespace {

double stepped(double value, double step) { return step > 0.0 ? step * std::round(value / step) : value; }

}  // namespace

void WristSensorOptions::validate() const {
  require(force_resolution >= 0.0, "force_resolution: must not be negative");
  require(torque_resolution >= 0.0, "torque_resolution: must not be negative");
  require(full_scale > 0.0, "full_scale: must be positive");
  require(Eigen::FullPivLU<Matrix6>(calibration).isInvertible(), "calibration: has no inverse");
}

WristSensor::WristSensor(const cell::Cell& cell, const WristSensorOptions& options)
    : sensor_(cell), filter_(sensor_.time_constant), noise_(cell.noise), options_(options), random_(options.seed) {
  options_.validate();
  bridges_ = options_.calibration.inverse();
}

Vector6 WristSensor::read(const Vector6& wrench, double t) {
  Vector6 felt = filter_.pass(sensor_.distorted(wrench, t), t);
  if (options_.noise)
    for (Eigen::Index i = 0; i < 6; ++i) felt[i] += random_.normal(i < 3 ? noise_.force : noise_.torque);
  const Vector6 wanted = bridges_ * felt;
  voltages_ = wanted.cwiseMax(-options_.full_scale).cwiseMin(options_.full_scale);
  saturated_ = voltages_ != wanted;
  Vector6 out = options_.calibration * voltages_;
  for (Eigen::Index i = 0; i < 6; ++i)
    out[i] = stepped(out[i], i < 3 ? options_.force_resolution : options_.torque_resolution);
  return out;
}

void WristSensor::restore(const WristSensorState& state) {
  filter_.restore(state.filter);
  random_.restore(state.random);
  saturated_ = state.saturated;
}

Encoders::Encoders(const physics::EffectiveDrives& drives, double counts, double noise, std::uint64_t seed)
    : count_(0.0), noise_(noise), random_(seed) {
  require(counts >= 0.0 && noise >= 0.0, "counts, noise: must not be negative");
  if (counts == 0.0) return;
  require(drives.motors.has_value(), "drives: encoders need motors, which this cell does not have");
  structure_ = drives.motors->structure;
  back_ = drives.motors->inverse;
  count_ = 2.0 * std::numbers::pi / counts;
}

Eigen::VectorXd Encoders::read(const Eigen::VectorXd& position) {
  Eigen::VectorXd seen = position;
  for (double& value : seen) value += random_.normal(noise_);
  if (count_ == 0.0) return seen;
  Eigen::VectorXd angle = structure_ * seen;
  for (double& value : angle) value = stepped(value, count_);
  return back_ * angle;
}

Eigen::VectorXd CurrentSensors::read(const Eigen::VectorXd& current) {
  Eigen::VectorXd out = current;
  for (Eigen::Index i = 0; noisy_ && i < out.size(); ++i)
    out[i] += random_.normal(noise_.of("current", static_cast<int>(i)));
  return out;
}

}  // namespace kr5::sim
