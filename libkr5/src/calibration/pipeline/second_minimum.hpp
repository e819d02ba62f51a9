// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include <kr5/calibration/second_minimum.hpp>

/// @file
/// Private: what a result says of another minimum of its cost.

namespace kr5::calibration::pipeline {

/// Probability of the second minimum from which the measurements do not tell which is right [-].
constexpr double undecided = 0.01;

/// The second minimum, by robust costs in standard deviations of a noise with so many degrees of freedom behind it;
/// empty where it is too much worse to be worth a word.
std::optional<SecondMinimum> second_minimum(const Pose& best, const Pose& second, double best_cost, double second_cost,
                                            double dof);

/// In words: "the other, 12.3 mm and 4.5 deg away, has 1.02 times the squared residuals".
std::string second_text(const SecondMinimum& second);

}  // namespace kr5::calibration::pipeline
