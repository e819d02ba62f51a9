// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/upright_lengths.hpp>

#include <algorithm>
#include <string>

#include <kr5/core/error.hpp>

#include "calibration/kinematics/shifted_axis.hpp"

namespace kr5::calibration {
namespace {

/// Why the distances do not tell the lengths of this arm; empty when they do.
std::string upright_objection(const ArmAxesResult& arm) {
  const std::size_t joints = arm.axes.size();
  if (joints != 6)
    return "the arm has " + std::to_string(joints) + " joints; the distances of parallel axes are those of six";
  double tolerance = 0.01;  // [m, rad]
  for (const JointAxisResult& axis : arm.axes) tolerance = std::max(tolerance, 3 * tilt_std(axis));
  const std::string objection = parallel_plane_objection(arm.arm, tolerance);
  return objection.empty() ? objection
                           : "the distances of parallel axes do not determine the lengths of this arm: " + objection;
}

}  // namespace

UprightLengths identify_upright_lengths(const ArmAxesResult& arm, const JointAxisResult& axis6_upright,
                                        const ParallelPlaneOptions& options) {
  options.validate();
  require(arm.fit.usable(), "arm: was not identified (" + arm.fit.message + ")");
  UprightLengths out;
  out.distances.objection = upright_objection(arm);
  if (!out.distances.objection.empty()) {
    out.lengths.fit.message = out.distances.objection;
    return out;
  }
  out.distances = parallel_plane_distances({.axis1 = arm.axes[0],
                                            .axis2 = arm.axes[1],
                                            .axis3 = arm.axes[2],
                                            .axis5 = arm.axes[4],
                                            .axis6 = arm.axes[5],
                                            .axis6_upright = axis6_upright});
  out.lengths = lengths_from_parallel_planes(out.distances, options);
  return out;
}

}  // namespace kr5::calibration
