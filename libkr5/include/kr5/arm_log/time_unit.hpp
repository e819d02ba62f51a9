// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/core/fields.hpp>

namespace kr5::arm_log {

/// Unit of the time stamps of a log.
enum class TimeUnit { Second, Millisecond, Microsecond, Nanosecond };
constexpr auto enum_names(TimeUnit) {
  return names<TimeUnit>({{TimeUnit::Second, "s"},
                          {TimeUnit::Millisecond, "ms"},
                          {TimeUnit::Microsecond, "us"},
                          {TimeUnit::Nanosecond, "ns"}});
}

/// Length of a unit [s].
double seconds_in(TimeUnit unit);

constexpr double usual_row_step = 0.005;  ///< Between rows of a controller's log [s].

/// The unit of time stamps of which nothing tells it: the one in which they are a time since 1970, of 2001 to 2096,
/// with rows not too far apart for a motion; else seconds, where their steps are those of a log in seconds; else the
/// one in which their median step is nearest to the usual one.
/// @param stamps In the unit; NaN where there is none. @param usual_step Between rows of such logs [s]; 0: not known,
/// stamps that are no time since 1970 are seconds.
/// @throws InvalidArgument for a usual step that is negative.
TimeUnit guess_time_unit(const Eigen::VectorXd& stamps, double usual_step = usual_row_step);

/// Whether stamps count rows, each one above the last, so that they tell no time: neither an interval nor a unit.
/// @param stamps NaN where there is none.
bool counts_rows(const Eigen::VectorXd& stamps);

}  // namespace kr5::arm_log
