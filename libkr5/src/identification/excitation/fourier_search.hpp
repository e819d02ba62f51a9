// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "identification/excitation/excitation_problem.hpp"

namespace kr5::identification {

/// What a search found; with an objection, nothing.
struct ExcitationSearch {
  ExcitationMotion motion;
  std::vector<double> condition_after;
  int exchanges = 0;       ///< That gained.
  int slowed_strokes = 0;  ///< Of the motion found, because of torques.
  std::string objection;   ///< What stood in the way of the last motion that was tried.
};

/// Step at which torques and heights of a motion that is considered are looked at [s].
constexpr double considered_interval = 0.01;

/// Exchanges the harmonics of one joint at a time.
ExcitationSearch search_fourier(ExcitationProblem& problem, const ExcitationOptions& options);

}  // namespace kr5::identification
