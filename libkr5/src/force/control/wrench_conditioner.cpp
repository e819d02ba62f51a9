// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/wrench_conditioner.hpp>

#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>
#include <kr5/robot/sensing.hpp>

namespace kr5::force {

WrenchLowPass::WrenchLowPass(double cutoff, double cycle) {
  require(cycle > 0 && std::isfinite(cycle), "cycle must be positive [s]");
  require(cutoff > 0 && cutoff < 0.5 / cycle, "cutoff must lie between 0 and half the rate of the cycles [Hz]");
  const double k = std::tan(M_PI * cutoff * cycle);
  for (std::size_t i = 0; i < sections_.size(); ++i) {
    const double damping = 2 * std::cos(M_PI * (2 * static_cast<double>(i) + 1) / 8);
    const double norm = 1 / (1 + damping * k + k * k);
    Section& s = sections_[i];
    s.b0 = k * k * norm;
    s.a1 = 2 * (k * k - 1) * norm;
    s.a2 = (1 - damping * k + k * k) * norm;
    // Group delay at rest of (1 + z^-1)^2 / (1 + a1 z^-1 + a2 z^-2), in cycles.
    delay_ += cycle * (1 - (s.a1 + 2 * s.a2) / (1 + s.a1 + s.a2));
  }
}

Vector6 WrenchLowPass::step(const Vector6& wrench) noexcept {
  if (!wrench.allFinite()) return Vector6::Constant(std::numeric_limits<double>::quiet_NaN());
  Vector6 x = wrench;
  for (Section& s : sections_) {
    if (!settled_) {  // the state that a constant leads to
      s.s1 = (1 - s.b0) * x;
      s.s2 = (s.b0 - s.a2) * x;
    }
    const Vector6 y = s.b0 * x + s.s1;
    s.s1 = 2 * s.b0 * x - s.a1 * y + s.s2;
    s.s2 = s.b0 * x - s.a2 * y;
    x = y;
  }
  settled_ = true;
  return x;
}

void WrenchConditionerOptions::validate() const {
  require(mass >= 0 && std::isfinite(mass), "mass must not be negative [kg]");
  require(com.allFinite(), "com must be finite [m]");
  require(gravity.allFinite(), "gravity must be finite [m/s^2]");
  WrenchLowPass(cutoff, cycle);
}

WrenchConditioner::WrenchConditioner(const WrenchConditionerOptions& options)
    : options_((options.validate(), options)), filter_(options.cutoff, options.cycle) {}

Vector6 WrenchConditioner::weight(const Eigen::Matrix3d& R_base_sensor) const noexcept {
  return robot::sensed_weight(options_.mass, options_.com, options_.gravity, R_base_sensor);
}

Vector6 WrenchConditioner::step(const Vector6& reading, const Eigen::Matrix3d& R_base_sensor) noexcept {
  const Vector6 wrench = reading - weight(R_base_sensor);
  if (wrench.allFinite()) last_ = wrench;  // tare() never takes as zero what is no number
  return filter_.step(wrench - zero_);
}

void WrenchConditioner::tare() noexcept {
  zero_ = last_;
  filter_.reset();
}

}  // namespace kr5::force
