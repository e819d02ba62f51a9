// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/two_publishers.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <vector>

#include <kr5/core/statistics.hpp>

namespace kr5::arm_log {
namespace {

// A reading that jumps away and comes straight back is a jump to and fro.
constexpr double jump_over_usual = 6.0;  // what readings change by
constexpr double jump_digits = 8.0;      // last digits of the encoder, which may flicker
constexpr double least_jump = 1e-3;      // [rad, m, or a smaller unit of the log]
constexpr double back_within = 0.3;      // of the jump
constexpr double share_of_turns = 0.05;  // of the readings, above which jumps are no disturbance
constexpr std::size_t fewest_readings = 20;

/// The size from which a change is a jump.
double jump_size(const std::vector<double>& x) {
  std::vector<double> usual;
  double digit = std::numeric_limits<double>::infinity();
  const auto see = [&](double change) {
    if (change > 0) digit = std::min(digit, change);
  };
  for (std::size_t k = 0; k + 2 < x.size(); ++k) {
    const double one = std::abs(x[k + 1] - x[k]), next = std::abs(x[k + 2] - x[k + 1]),
                 both = std::abs(x[k + 2] - x[k]);
    usual.push_back(std::min({one, next, both}));
    see(one), see(next), see(both);
  }
  return std::max({least_jump, jump_over_usual * midpoint_median(std::move(usual)), jump_digits * digit});
}

}  // namespace

bool written_in_turn(const Eigen::VectorXd& positions) {
  std::vector<double> x;
  std::copy_if(positions.begin(), positions.end(), std::back_inserter(x), [](double v) { return std::isfinite(v); });
  if (x.size() < fewest_readings) return false;
  const double jump = jump_size(x);
  std::size_t turns = 0;
  for (std::size_t k = 0; k + 2 < x.size(); ++k) {
    const double one = x[k + 1] - x[k], next = x[k + 2] - x[k + 1];
    turns += std::abs(one) > jump && std::abs(next) > jump && one * next < 0 &&
             std::abs(x[k + 2] - x[k]) < back_within * std::abs(one);
  }
  return static_cast<double>(turns) > share_of_turns * static_cast<double>(x.size() - 2);
}

}  // namespace kr5::arm_log
