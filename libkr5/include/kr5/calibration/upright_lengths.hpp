// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/calibration/arm_axes.hpp>
#include <kr5/calibration/parallel_planes.hpp>

/// @file
/// Lengths of an identified arm by parallel planes, with one more turn of joint 6.

namespace kr5::calibration {

/// Lengths, and the distances that they follow from.
struct UprightLengths {
  ParallelPlaneDistances distances;
  ParallelPlaneLengths lengths;

  static void each_field(auto& self, auto&& visit) {
    visit("distances", self.distances, "Distances of parallel axes.");
    visit("lengths", self.lengths, "Lengths of the arm; its fit says why there are none.");
  }
};

/// Lengths from the axes of an arm whose forearm stood across axis 1 and from its axis 6 with the forearm along axis 1.
/// An arm whose lengths these distances do not tell, by parallel_plane_objection within 10 mm or three standard
/// deviations of the tilts, gives FitStatus::Degenerate with the reason.
/// @throws InvalidArgument for axes that were not identified, or invalid options.
UprightLengths identify_upright_lengths(const ArmAxesResult& arm, const JointAxisResult& axis6_upright,
                                        const ParallelPlaneOptions& options = {});

}  // namespace kr5::calibration
