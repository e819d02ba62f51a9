// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/identification/servo.hpp>
#include <kr5/physics/row_range.hpp>

/// @file
/// The response of a servo to a log, and what a response shows besides the parameters of the servo.

namespace kr5::identification {

/// Position and speed of a servo of gain 1 under the commands of a log, a row a sample.
Eigen::Matrix<double, Eigen::Dynamic, 2> servo_response(const cell::SecondOrder& servo, const ServoLog& log,
                                                        const std::vector<physics::RowRange>& runs, CommandShape shape);

/// Middle of the times between samples [s].
double median_cycle(const ServoLog& log, const std::vector<physics::RowRange>& runs);

/// Standard deviation of the noise from one sample to the next, from second differences, whatever the slow motion is.
double neighbour_noise(const Eigen::VectorXd& values, const std::vector<physics::RowRange>& runs);

/// The formula of the overshoot on the largest step of the command, where one is seen above the noise.
std::optional<OvershootReading> read_overshoot(const ServoLog& log, const std::vector<physics::RowRange>& runs,
                                               const ServoResult& found);

/// The stretch in which the response moves at its greatest speed, when it is far longer than that of the fitted servo.
struct SpeedPlateau {
  double speed = 0.0;           ///< [m/s or rad/s]
  double from = 0.0, to = 0.0;  ///< [s]
};
std::optional<SpeedPlateau> find_speed_plateau(const ServoLog& log, const std::vector<physics::RowRange>& runs,
                                               const ServoResult& found);

}  // namespace kr5::identification
