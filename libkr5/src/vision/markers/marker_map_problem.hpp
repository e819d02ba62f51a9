// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include <kr5/vision/marker_map.hpp>

namespace kr5::vision {

/// One marker seen in one image, by position in the lists of markers and images.
struct IndexedSighting {
  int image = 0, marker = 0;
  Eigen::Matrix<double, 2, 4> corners;
};

/// A position in a list of markers or images.
inline std::size_t list_index(int i) { return static_cast<std::size_t>(i); }

struct MapProblem {
  const Pinhole& camera;
  Eigen::Matrix<double, 3, 4> square;
  int images = 0, markers = 0, reference = 0;
  std::vector<IndexedSighting> sightings;
};

struct MapState {
  std::vector<Pose> T_map_marker, T_camera_map;
};

}  // namespace kr5::vision
