// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/arm_log.hpp>

#include <cmath>
#include <string>
#include <utility>

#include <kr5/core/error.hpp>

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr Index fewest_logged_rows = 30;

void require_channel(const std::string& name, const MatrixXd& values, Index rows, int joints) {
  if (values.size() == 0) return;
  require(values.rows() == rows && values.cols() == joints,
          name + ": found " + std::to_string(values.rows()) + " x " + std::to_string(values.cols()) +
              " numbers, expected " + std::to_string(rows) + " x " + std::to_string(joints) +
              ": a row for each time, a column for each joint of the model");
  if (values.allFinite()) return;
  for (Index i = 0; i < rows; ++i)
    for (Index j = 0; j < joints; ++j)
      require(std::isfinite(values(i, j)), name + ": row " + std::to_string(i) + ", joint " + std::to_string(j + 1) +
                                               ": found no finite number; leave the row out, or interpolate it");
}

}  // namespace

void ArmLog::validate(int joints) const {
  require(t.size() >= fewest_logged_rows, "t: found " + std::to_string(t.size()) + " rows, expected at least " +
                                              std::to_string(fewest_logged_rows) + "; log a longer motion");
  for (const auto& [name, values] : {std::pair<const char*, const MatrixXd*>{"q", &q},
                                     {"command", &command},
                                     {"effort", &effort},
                                     {"current", &current}})
    require_channel(name, *values, t.size(), joints);
  for (Index i = 0; i < t.size(); ++i) {
    require(std::isfinite(t[i]), "t: row " + std::to_string(i) + ": found no finite time [s]");
    require(i == 0 || t[i] > t[i - 1], "t: row " + std::to_string(i) +
                                           " is not later than the one before [s]; sort the rows, and leave out those "
                                           "of equal time");
  }
  require(servo_gain.size() == 0 || servo_gain.size() == t.size(),
          "servo_gain: found " + std::to_string(servo_gain.size()) + " numbers, expected " + std::to_string(t.size()) +
              ": one for each time");
  for (Index i = 0; i < servo_gain.size(); ++i)
    require(servo_gain[i] >= 0.0 && std::isfinite(servo_gain[i]),
            "servo_gain: row " + std::to_string(i) + ": expected a gain, or 0 for motors that are off");
  require(q.size() > 0 || command.size() > 0, "q: found neither positions nor commands; a motion needs one of them");
  require(effort.size() > 0 || current.size() > 0 || (q.size() > 0 && command.size() > 0),
          "effort: found neither efforts nor currents; log those of every joint, or commands and measured positions");
}

}  // namespace kr5::arm_log
