// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

/// @file
/// The test by which calibrations on a fit name outliers.

namespace kr5::fit::pipeline {

/// Probability that a sound measurement of so many rows lies at such a squared distance from what the others say (see
/// fit::Agreement); 0 for one the model cannot show. `used`: it took part in the fit, and so in the estimate of the
/// noise, of `dof` degrees of freedom or uncertainty::known_noise.
double sound_probability(double squared_distance, double rows, bool used, double dof);

/// Takes measurements out of a fit (weight 0) and puts them back in until each is where its test puts it, or has come
/// back twice; at least `fewest` stay in. `probabilities` gives that of each being sound, `refit` fits with the present
/// weights.
void settle_outliers(std::vector<double>& weights, double false_alarm, std::size_t fewest,
                     const std::function<std::vector<double>()>& probabilities, const std::function<void()>& refit);

}  // namespace kr5::fit::pipeline
