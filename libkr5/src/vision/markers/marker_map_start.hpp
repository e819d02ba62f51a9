// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include <kr5/geometry/resection.hpp>

#include "vision/markers/marker_map_problem.hpp"

namespace kr5::vision {

/// Pose of a map in an image from all markers that the image shows.
std::optional<Resection> camera_in_map(const MapProblem& problem, const MapState& state, int image);

/// Poses of all markers and images that hang together with the reference, from neighbour to neighbour; the best first.
/// Others where the images are explained nearly as well: with a marker in the other pose that its corners allow, or the
/// whole map turned over, which images taken from far off and from the front cannot tell from it (Necker's cube). Empty
/// when no pose explains one of the images.
std::vector<MapState> start_maps(const MapProblem& problem);

}  // namespace kr5::vision
