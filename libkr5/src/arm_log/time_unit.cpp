// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/time_unit.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>

namespace kr5::arm_log {
namespace {

constexpr double least_step = 1e-4, most_step = 0.5;  // between rows of a log in seconds [s]
constexpr double slowest_step = 1.0;          // of stamps since 1970; whole counts of a finer unit step by more [s]
constexpr double oldest = 1e9, newest = 4e9;  // since 1970 [s]
constexpr double shortest_step = 1e-12;       // of stamps that stand still

constexpr TimeUnit units[] = {TimeUnit::Second, TimeUnit::Millisecond, TimeUnit::Microsecond, TimeUnit::Nanosecond};

/// Median of the steps forward, in the unit of the stamps; 0 where there is none.
double forward_step(const Eigen::VectorXd& stamps) {
  std::vector<double> steps;
  const double* last = nullptr;
  for (const double& stamp : stamps) {
    if (!std::isfinite(stamp)) continue;
    if (last && stamp > *last) steps.push_back(stamp - *last);
    last = &stamp;
  }
  return midpoint_median(std::move(steps));
}

std::optional<TimeUnit> unit_since_1970(const Eigen::VectorXd& stamps, double step) {
  double latest = 0.0;
  for (const double stamp : stamps)
    if (std::isfinite(stamp)) latest = std::max(latest, stamp);
  for (const TimeUnit unit : units) {
    const double at = latest * seconds_in(unit);
    if (at > oldest && at < newest && step * seconds_in(unit) < slowest_step) return unit;
  }
  return std::nullopt;
}

}  // namespace

double seconds_in(TimeUnit unit) {
  switch (unit) {
    case TimeUnit::Second:
      return 1.0;
    case TimeUnit::Millisecond:
      return 1e-3;
    case TimeUnit::Microsecond:
      return 1e-6;
    case TimeUnit::Nanosecond:
      return 1e-9;
  }
  throw InvalidArgument("unit: is none of time");
}

TimeUnit guess_time_unit(const Eigen::VectorXd& stamps, double usual_step) {
  require(usual_step >= 0 && std::isfinite(usual_step), "usual_step must not be negative [s]; 0 means not known");
  const double step = forward_step(stamps);
  if (const auto unit = unit_since_1970(stamps, step)) return *unit;
  if (usual_step == 0 || (step >= least_step && step <= most_step)) return TimeUnit::Second;
  return *std::min_element(std::begin(units), std::end(units), [&](TimeUnit a, TimeUnit b) {
    const auto off = [&](TimeUnit unit) {
      return std::abs(std::log(std::max(step, shortest_step) * seconds_in(unit) / usual_step));
    };
    return off(a) < off(b);
  });
}

bool counts_rows(const Eigen::VectorXd& stamps) {
  constexpr Eigen::Index fewest_rows = 10;
  if (stamps.size() < fewest_rows || std::abs(stamps[0]) > 1) return false;
  return ((stamps.tail(stamps.size() - 1) - stamps.head(stamps.size() - 1)).array() == 1.0).all();
}

}  // namespace kr5::arm_log
