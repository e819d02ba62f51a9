// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "vision/markers/marker_map_problem.hpp"

namespace kr5::vision {

struct MapSolution {
  double cost = 0.0;            ///< Sum of squared residuals [px^2].
  Eigen::MatrixXd information;  ///< Of the markers without the reference, then the images, for noise of 1 px.
  int iterations = 0;
  bool converged = false;
};
/// Levenberg-Marquardt over all poses. The reference stays.
MapSolution adjust_map(const MapProblem& problem, MapState& state, int max_iterations);

/// Seen minus predicted corners, 8 numbers [px]; false when a corner lies behind the camera.
bool map_residual(const MapProblem& problem, const Sighting& s, const MapState& state, Eigen::Matrix<double, 8, 1>& r,
                  Eigen::Matrix<double, 8, 6>* by_marker, Eigen::Matrix<double, 8, 6>* by_camera);

}  // namespace kr5::vision
