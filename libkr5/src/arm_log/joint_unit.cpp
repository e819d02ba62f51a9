// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/joint_unit.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double most_ticks = 4095.0;
constexpr double beyond_degrees = 400.0;   // more than a turn
constexpr std::size_t fewest_counts = 20;  // different ones, as an encoder that moves shows
constexpr double full_range = 100.0;       // of a range [%]
constexpr double rounding = 1e-6;          // [%]
constexpr int rests_at_end = 2;            // readings at exactly 100 %, which measured degrees do not repeat
constexpr double degree = std::numbers::pi / 180;
constexpr double calibration_room = 10.0 * degree;  // by which a calibration may leave the limits of a model

struct Numbers {
  double least = std::numeric_limits<double>::infinity(), most = -least;
  bool whole = true;
  int at_hundred = 0;
  std::set<double> different;
};

Numbers numbers_of(const MatrixXd& values) {
  Numbers out;
  for (const double value : values.reshaped()) {
    if (!std::isfinite(value)) continue;
    out.least = std::min(out.least, value), out.most = std::max(out.most, value);
    out.whole = out.whole && value == std::round(value);
    out.at_hundred += std::abs(std::abs(value) - full_range) < rounding;
    if (out.different.size() < fewest_counts) out.different.insert(value);
  }
  return out;
}

/// Whether degrees lie within the limits of the joints, those that are known.
bool within_limits(const MatrixXd& values, const VectorXd& lower, const VectorXd& upper) {
  if (lower.size() != values.cols() || upper.size() != values.cols()) return true;
  for (Index k = 0; k < values.cols(); ++k)
    for (const double value : values.col(k))
      if (degree * value < lower[k] - calibration_room || degree * value > upper[k] + calibration_room) return false;
  return true;
}

}  // namespace

JointUnitGuess guess_joint_unit(const MatrixXd& values, const VectorXd& lower, const VectorXd& upper) {
  const Numbers found = numbers_of(values);
  const double size = std::max(found.most, -found.least);
  if (!(size > max_radians)) return {};
  if (found.whole && found.least >= 0 && found.most <= most_ticks && found.most > beyond_degrees &&
      found.different.size() >= fewest_counts)
    return {.unit = JointUnit::Tick};
  if (size > full_range + rounding) return {.unit = JointUnit::Degree};
  const JointUnit percent = found.least < -rounding ? JointUnit::SignedPercent : JointUnit::Percent;
  if (found.at_hundred >= rests_at_end || !within_limits(values, lower, upper)) return {.unit = percent};
  return {.unit = JointUnit::Degree, .degrees_or_percent = true};
}

bool magnitudes_only(const MatrixXd& loads) {
  if (loads.cols() < 2) return false;
  for (Index k = 0; k < loads.cols(); ++k) {
    const Numbers found = numbers_of(loads.col(k));
    if (found.least < 0 || !(found.most > found.least)) return false;
  }
  return true;
}

}  // namespace kr5::arm_log
