// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "vision/markers/marker_map_problem.hpp"

namespace kr5::vision {

struct MapSolution {
  double cost = 0.0;                ///< Sum of squared residuals [px^2].
  std::vector<double> squares;      ///< Of each sighting, likewise.
  std::vector<Matrix6> covariance;  ///< Of the markers, right perturbation, for noise of 1 px; zero of the reference.
  bool determined = false;          ///< Whether the images determine every marker.
  int iterations = 0;
  bool converged = false;
};
/// Poses of all markers and images that fit the pixels best. The reference stays.
MapSolution adjust_map(const MapProblem& problem, MapState& state, int max_iterations);

}  // namespace kr5::vision
