// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/vision/marker_map.hpp>

namespace kr5::vision {

/// One marker seen in one image, by position in the lists of markers and images.
struct Sighting {
  int image = 0, marker = 0;
  Eigen::Matrix<double, 2, 4> corners;
};

struct MapProblem {
  const Pinhole& camera;
  Eigen::Matrix<double, 3, 4> square;
  int images = 0, markers = 0, reference = 0;
  std::vector<Sighting> sightings;
};

struct MapState {
  std::vector<Pose> T_map_marker, T_camera_map;
  std::vector<bool> marker_known, camera_known;
};

/// First poses of all markers and images that hang together with the reference, from neighbour to neighbour.
MapState start_map(const MapProblem& problem);

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
