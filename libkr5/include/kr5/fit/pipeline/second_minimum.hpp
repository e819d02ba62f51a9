// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Another answer that explains the measurements of a calibration nearly as well as the one it found.

namespace kr5::fit::pipeline {

/// The second-best minimum of the cost of a calibration.
struct SecondMinimum {
  Pose T = Pose::Identity();
  double cost_ratio = 0.0;   ///< [-]
  double probability = 0.0;  ///< [-]
  double position = 0.0;     ///< [m]
  double rotation = 0.0;     ///< [rad]

  static void each_field(auto& self, auto&& visit) {
    visit("T", self.T, "The calibrated pose, as it would be there.");
    visit("cost_ratio", self.cost_ratio, "Robust sum of squared residuals there over that of the result [-].");
    visit("probability", self.probability,
          "Probability of being the right one of the two, for noise as it was found [-].");
    visit("position", self.position, "Distance from the result [m].");
    visit("rotation", self.rotation, "Angle from the result [rad].");
  }
};

/// Probability of the second minimum from which the measurements do not tell which is right [-].
constexpr double undecided = 0.01;

/// The second minimum, by robust costs in standard deviations of a noise with so many degrees of freedom behind it;
/// empty where it is too much worse to be worth a word.
std::optional<SecondMinimum> second_minimum(const Pose& best, const Pose& second, double best_cost, double second_cost,
                                            double dof);

/// Refuses a result that is usable otherwise where the measurements do not tell which of the two is right. `claim`:
/// "two poses of the camera explain the views"; an earlier reason to refuse it stays the message.
void refuse_undecided(const std::optional<SecondMinimum>& second, const std::string& claim, const std::string& remedy,
                      FitReport& fit);

/// In words: "the other, 12.3 mm and 4.5 deg away, has 1.02 times the squared residuals".
std::string second_text(const SecondMinimum& second);

}  // namespace kr5::fit::pipeline
