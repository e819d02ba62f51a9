// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "vision/markers/marker_map_problem.hpp"

namespace kr5::vision {

/// First poses of all markers and images that hang together with the reference, from neighbour to neighbour.
MapState start_map(const MapProblem& problem);

}  // namespace kr5::vision
