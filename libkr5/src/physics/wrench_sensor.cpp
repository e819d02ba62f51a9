// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/wrench_sensor.hpp>

#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::physics {

using Eigen::Index;

namespace {

Vector6 each_component(const cell::Cell& cell, const char* effect, const char* parameter) {
  Vector6 out;
  for (int c = 0; c < 6; ++c) out[c] = cell.effects.number(effect, parameter, c);
  return out;
}

}  // namespace

Vector6 ft_gain(const cell::Cell& cell) { return each_component(cell, "ft_gain", "gain"); }
Vector6 ft_bias(const cell::Cell& cell) { return each_component(cell, "ft_bias", "bias"); }
Vector6 ft_drift(const cell::Cell& cell) { return each_component(cell, "ft_drift", "rate"); }

Matrix6 ft_crosstalk(const cell::Cell& cell) {
  Matrix6 out = Matrix6::Zero();
  for (int c = 0; c < 6; ++c) {
    const int source = static_cast<int>(cell.effects.number("ft_crosstalk", "source", c));
    require(source >= 0 && source < 6,
            "effects.ft_crosstalk: source: found " + std::to_string(source) + ", expected 0 to 5");
    out(c, source) = cell.effects.number("ft_crosstalk", "gain", c);
  }
  return out;
}

double ft_lag(double time_constant, double dt) {
  return time_constant > 0.0 ? 1.0 - std::exp(-dt / time_constant) : 1.0;
}

Vector6 WrenchFilter::pass(const Vector6& wrench, double t) {
  if (state_.started && time_constant_ > 0.0)
    state_.shown += ft_lag(time_constant_, t - state_.last) * (wrench - state_.shown);
  else
    state_.shown = wrench;
  state_.last = t;
  state_.started = true;
  return state_.shown;
}

WrenchSensor::WrenchSensor(const cell::Cell& cell)
    : gain(ft_crosstalk(cell)),
      bias(ft_bias(cell)),
      rate(ft_drift(cell)),
      time_constant(cell.effects.number("ft_lag", "time_constant")) {
  gain.diagonal() += ft_gain(cell);
}

void apply_sensor_effects(const WrenchSensor& sensor, const Eigen::VectorXd& t, const std::vector<RowRange>& runs,
                          Eigen::Ref<Eigen::MatrixXd> wrench) {
  if (!sensor.gain.isIdentity(0.0)) wrench = (wrench * sensor.gain.transpose()).eval();
  for (Index c = 0; c < 6; ++c) wrench.col(c).array() += sensor.bias[c] + sensor.rate[c] * t.array();
  if (sensor.time_constant <= 0.0) return;
  for (const RowRange& run : runs) {
    WrenchFilter filter(sensor.time_constant);
    for (Index i = run.first; i < run.last; ++i) wrench.row(i) = filter.pass(wrench.row(i), t[i]);
  }
}

}  // namespace kr5::physics
