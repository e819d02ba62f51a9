// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/force_loop_design.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <kr5/core/error.hpp>
#include <kr5/physics/second_order.hpp>

namespace kr5::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;
using force::CorrectionReference;

void ForceLoopPlant::validate() const {
  require(servo.natural_frequency > 0 && std::isfinite(servo.natural_frequency),
          "servo.natural_frequency must be positive [rad/s]");
  require(servo.damping_ratio > 0 && std::isfinite(servo.damping_ratio), "servo.damping_ratio must be positive [-]");
  require(cycle > 0 && std::isfinite(cycle), "cycle must be positive [s]");
  constexpr double most_cycles = 50;  // eigenvalues of larger matrices take seconds
  require(servo.delay >= 0 && servo.delay <= most_cycles * cycle, "servo.delay must lie between 0 and 50 cycles [s]");
  require(servo_gain > 0 && std::isfinite(servo_gain), "servo_gain must be positive [-]");
  require(stiffness > 0 && std::isfinite(stiffness), "stiffness must be positive [N/m]");
  require(damping >= 0 && std::isfinite(damping), "damping must not be negative [N s/m]");
}

void ForceLoopDesignOptions::validate() const {
  require(reference > 0 && std::isfinite(reference), "reference must be positive [N]");
  require(lowest_stiffness >= 0 && std::isfinite(lowest_stiffness), "lowest_stiffness must not be negative [N/m]");
  require(highest_stiffness >= 0 && std::isfinite(highest_stiffness), "highest_stiffness must not be negative [N/m]");
  require(points >= 1 && points <= 1000, "points must lie between 1 and 1000");
  require(max_overshoot > 0 && std::isfinite(max_overshoot), "max_overshoot must be positive [-]");
  require(min_gain_margin > 1 && std::isfinite(min_gain_margin), "min_gain_margin must be above 1 [-]");
  require(duration > 0 && std::isfinite(duration), "duration must be positive [s]");
}

namespace {

/// x+ = A x + b u, f = c x: servo, delay line and contact from one cycle to the next.
struct SampledPlant {
  MatrixXd A;
  VectorXd b;
  RowVectorXd force;     ///< [N]
  RowVectorXd position;  ///< [m]
};

SampledPlant sample(const ForceLoopPlant& plant) {
  // A delay of m cycles less a part: the older command acts for the first part of the cycle, the newer one after it.
  constexpr double rounding = 1e-9;  // of a cycle
  const double cycles = plant.servo.delay / plant.cycle;
  const auto whole = static_cast<Index>(std::floor(cycles + rounding));
  const double late = std::max(cycles - static_cast<double>(whole), 0.0) * plant.cycle;
  const bool split = late > rounding * plant.cycle;
  const Index line = whole + (split ? 1 : 0), n = 2 + line;
  const Eigen::Matrix2d first = physics::transition(plant.servo, late);
  const Eigen::Matrix2d second = physics::transition(plant.servo, plant.cycle - late);
  const Eigen::Vector2d held = Eigen::Vector2d(plant.servo_gain, 0.0);
  const Eigen::Vector2d older = second * (held - first * held), newer = held - second * held;

  SampledPlant out{MatrixXd::Zero(n, n), VectorXd::Zero(n), RowVectorXd::Zero(n), RowVectorXd::Zero(n)};
  out.A.topLeftCorner<2, 2>() = second * first;
  if (split) out.A.block<2, 1>(0, 2) += older;
  const Index next = split ? 3 : 2;  // the command of the second part; the one given now, when none waits
  if (next < n) {
    out.A.block<2, 1>(0, next) += newer;
  } else {
    out.b.head<2>() += newer;
  }
  for (Index i = 2; i + 1 < n; ++i) out.A(i, i + 1) = 1.0;
  if (line > 0) out.b[n - 1] = 1.0;
  out.force[0] = plant.stiffness;
  out.force[1] = plant.damping;
  out.position[0] = 1.0;
  return out;
}

/// Feedback u = feedback x + k_p C f_d.
MatrixXd closed(const SampledPlant& sampled, CorrectionReference correction, double gain) {
  RowVectorXd feedback = -gain * sampled.force;
  if (correction == CorrectionReference::Actual) feedback += sampled.position;
  return sampled.A + sampled.b * feedback;
}

double spectral_radius(const MatrixXd& A) { return A.eigenvalues().cwiseAbs().maxCoeff(); }

/// Gain at which the first eigenvalue leaves the unit circle, from small gains upwards.
double gain_limit(const SampledPlant& sampled, CorrectionReference correction, double stiffness) {
  const auto unstable = [&](double gain) { return spectral_radius(closed(sampled, correction, gain)) >= 1.0; };
  constexpr double smallest = 1e-4, greatest = 1e6, factor = 1.15;  // of the gain times the stiffness
  double low = smallest / stiffness;
  if (unstable(low)) return 0.0;
  double high = factor * low;
  while (!unstable(high) && high * stiffness < greatest) low = high, high *= factor;
  for (int i = 0; i < 60; ++i) {
    const double middle = std::sqrt(low * high);
    (unstable(middle) ? high : low) = middle;
  }
  return std::sqrt(low * high);
}

/// Gain times force per correction at a frequency: the open loop, in which corrections of the actual pose add up.
std::complex<double> open_loop(const SampledPlant& sampled, CorrectionReference correction, double gain, double angle) {
  const Index n = sampled.A.rows();
  MatrixXd A = sampled.A;
  if (correction == CorrectionReference::Actual) A += sampled.b * sampled.position;
  const Eigen::MatrixXcd shifted = std::polar(1.0, angle) * Eigen::MatrixXcd::Identity(n, n) - A;
  const Eigen::VectorXcd x = shifted.partialPivLu().solve(sampled.b.cast<std::complex<double>>());
  return gain * (sampled.force.cast<std::complex<double>>() * x)(0);
}

std::optional<double> phase_margin(const SampledPlant& sampled, CorrectionReference correction, double gain) {
  const auto magnitude = [&](double angle) { return std::abs(open_loop(sampled, correction, gain, angle)); };
  constexpr int steps = 400;
  constexpr double lowest = 1e-5;  // [rad a cycle]
  const double factor = std::pow(std::numbers::pi / lowest, 1.0 / steps);
  std::optional<double> out;
  double angle = lowest, last = magnitude(angle);
  for (int i = 0; i < steps; ++i) {
    const double next_angle = std::min(angle * factor, std::numbers::pi), next = magnitude(next_angle);
    if ((last > 1) != (next > 1)) {
      double low = angle, high = next_angle;
      for (int k = 0; k < 50; ++k) {
        const double middle = std::sqrt(low * high);
        ((magnitude(middle) > 1) == (last > 1) ? low : high) = middle;
      }
      const double margin = std::numbers::pi - std::abs(std::arg(open_loop(sampled, correction, gain, low)));
      out = std::min(out.value_or(margin), margin);
    }
    angle = next_angle, last = next;
  }
  return out;
}

/// Force in each cycle after a step of the reference, from rest at the point of contact.
void respond(const SampledPlant& sampled, const MatrixXd& loop, double pushed, const ForceLoopPlant& plant,
             const ForceLoopDesignOptions& options, ForceLoopPoint& out) {
  const Index n = loop.rows();
  const VectorXd rest = (MatrixXd::Identity(n, n) - loop).partialPivLu().solve(sampled.b * pushed);
  out.final_force = sampled.force * rest;
  out.steady_error = out.final_force / options.reference - 1;
  VectorXd x = VectorXd::Zero(n);
  double most = 0.0;
  constexpr double most_computed = 2e4;  // cycles
  const auto cycles = static_cast<int>(std::min(std::ceil(options.duration / plant.cycle), most_computed));
  for (int k = 1; k <= cycles; ++k) {
    x = loop * x + sampled.b * pushed;
    const double force = sampled.force * x;
    if (force > most) most = force, out.peak_time = k * plant.cycle;
    if (std::abs(force - out.final_force) > 0.02 * out.final_force) out.settling_time = k * plant.cycle;
  }
  out.overshoot = std::max(most / out.final_force - 1, 0.0);
}

ForceLoopPoint at_stiffness(ForceLoopPlant plant, double stiffness, const force::ForceLoopOptions& loop,
                            const ForceLoopDesignOptions& options) {
  plant.stiffness = stiffness;
  const SampledPlant sampled = sample(plant);
  const MatrixXd matrix = closed(sampled, loop.correction, loop.gain);
  ForceLoopPoint out;
  out.stiffness = stiffness;
  out.spectral_radius = spectral_radius(matrix);
  out.stable = out.spectral_radius < 1;
  out.gain_limit = gain_limit(sampled, loop.correction, stiffness);
  out.gain_margin = out.gain_limit / loop.gain;
  if (!out.stable) return out;
  out.phase_margin = phase_margin(sampled, loop.correction, loop.gain);
  respond(sampled, matrix, loop.gain * loop.compensator() * options.reference, plant, options, out);
  return out;
}

/// Whether a gain keeps to what is asked at a stiffness.
bool keeps(const ForceLoopPlant& at, force::ForceLoopOptions loop, double gain, double limit,
           const ForceLoopDesignOptions& options) {
  loop.gain = gain;
  if (limit < options.min_gain_margin * gain) return false;
  const SampledPlant sampled = sample(at);
  ForceLoopPoint point;
  respond(sampled, closed(sampled, loop.correction, gain), gain * loop.compensator() * options.reference, at, options,
          point);
  return point.overshoot <= options.max_overshoot;
}

double recommend_gain(ForceLoopPlant plant, const force::ForceLoopOptions& loop, const ForceLoopDesignOptions& options,
                      double lowest, double highest) {
  double out = 0.0;
  for (const double stiffness : {lowest, highest}) {
    plant.stiffness = stiffness;
    const double limit = gain_limit(sample(plant), loop.correction, stiffness);
    double low = 1e-4 * limit, high = limit / options.min_gain_margin;
    if (limit == 0.0 || !keeps(plant, loop, low, limit, options)) return 0.0;
    if (keeps(plant, loop, high, limit, options)) low = high;
    for (int i = 0; i < 25 && low < high; ++i) {
      const double middle = std::sqrt(low * high);
      (keeps(plant, loop, middle, limit, options) ? low : high) = middle;
    }
    out = out == 0.0 ? low : std::min(out, low);
  }
  return out;
}

}  // namespace

MatrixXd force_loop_matrix(const ForceLoopPlant& plant, CorrectionReference correction, double gain) {
  plant.validate();
  return closed(sample(plant), correction, gain);
}

ForceLoopDesign design_force_loop(const ForceLoopPlant& plant, const force::ForceLoopOptions& loop,
                                  const ForceLoopDesignOptions& options) {
  plant.validate();
  loop.validate();
  options.validate();
  const double lowest = options.lowest_stiffness > 0 ? options.lowest_stiffness : plant.stiffness / 2;
  const double highest = options.highest_stiffness > 0 ? options.highest_stiffness : plant.stiffness * 2;
  require(highest >= lowest, "highest_stiffness must not be below lowest_stiffness [N/m]");
  ForceLoopDesign out;
  out.compensator = loop.compensator();
  out.uncompensated_error =
      loop.correction == CorrectionReference::Start ? 1 / (1 + loop.gain * plant.servo_gain * plant.stiffness) : 0.0;
  out.contact_speed = loop.contact_speed(options.reference, plant.cycle);
  out.nominal = at_stiffness(plant, plant.stiffness, loop, options);
  for (int i = 0; i < options.points; ++i) {
    const double part = options.points > 1 ? i / (options.points - 1.0) : 0.5;
    out.range.push_back(at_stiffness(plant, lowest * std::pow(highest / lowest, part), loop, options));
  }
  out.recommended_gain = recommend_gain(plant, loop, options, lowest, highest);
  return out;
}

}  // namespace kr5::identification
