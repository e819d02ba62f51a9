// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/picking/pellets.hpp>

#include "ray_grid.hpp"
#include "solid_cylinder.hpp"

namespace kr5::picking {

/// What the rays say of a cylinder.
struct RayVerdict {
  int on = 0;          ///< End on it.
  int before = 0;      ///< Would meet it, but end before: something hides it.
  int close = 0;       ///< Of those, the ones that end just before: its surface should have been there.
  int through = 0;     ///< Pass through it.
  int under = 0;       ///< End below its surface, though not far: the surface is another one.
  int new_on = 0;      ///< End on it and on no cylinder that was found before.
  int about = 0;       ///< Cross the plane of its face just outside the rim.
  int level = 0;       ///< Of those, the ones that end there, on no other cylinder: its surface goes on beyond the rim.
  int inside_rim = 0;  ///< Cross the plane of its face just inside the rim, and are not stopped before.
  int past_rim = 0;    ///< Of those, the ones that pass through.
  double misfit = 0.0;  ///< Sum of squared distances of those that end on it; one at the limit of likelihood counts 1.

  double exposed() const { return on == 0 ? 0.0 : on / static_cast<double>(on + before + through); }
  double crossed() const { return on == 0 ? 1.0 : (through + under) / static_cast<double>(on + through + under); }
  double beyond_rim() const { return about < 10 ? 0.0 : level / static_cast<double>(about); }
  double broken_rim() const { return inside_rim < 10 ? 0.0 : past_rim / static_cast<double>(inside_rim); }
  double score() const { return on - misfit - 3.0 * through - close; }
};

/// Rays, what is known of the cylinders, and which points have been explained.
struct PelletScene {
  const PelletOptions& options;
  const RayGrid& rays;          ///< Those that are used: fewer while hypotheses are compared, all for the last fit.
  std::vector<bool> explained;  ///< By column of the cloud.
  double noise = 0.0;           ///< [m]
  double slack = 0.0;           ///< Tangent of the angle by which rays may run otherwise than is thought.

  /// Distance from a surface up to which a point may belong to it [m].
  double tolerance() const { return std::max(4 * noise, 0.04 * options.radius); }
  /// Depth under a surface from which a ray has passed through it [m].
  double depth() const { return std::max(6 * noise, 0.1 * options.radius); }
  double middle_height() const { return (options.min_height + options.max_height) / 2; }
};

/// Whether a ray ends beyond the cylinder, having passed through it. q, e: its end and direction in local coordinates.
/// The deeper below the surface it ends, the further it may have passed by if it runs otherwise than is thought.
inline bool passes_through(const PelletScene& scene, const SolidCylinder& cylinder, const SolidCylinder::Chord& chord,
                           const Eigen::Vector3d& q, const Eigen::Vector3d& e) {
  if (std::min(-chord.in, chord.out - chord.in) <= scene.depth()) return false;
  const double off = scene.slack * -chord.in;
  SolidCylinder core = cylinder;
  core.radius -= off;
  core.height -= 2 * off;
  return core.radius > 0 && core.height > 0 && core.chord(q, e).hits();
}

RayVerdict judge(const PelletScene& scene, const SolidCylinder& cylinder);

struct PelletFit {
  SolidCylinder cylinder;
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Identity();
  RayVerdict verdict;
  int side = 0, face = 0, edges = 0;  ///< Observations.
  double rms = 0.0;                   ///< Distance of the points [m].
};

/// Where a fit starts.
enum class FitStart {
  Hypothesis,  ///< Some way off: points are first taken from further away.
  Fitted,      ///< At the fit to fewer rays.
};

/// The cylinder of least squared distances near `start`: its side and ends to the points on them, its edges to the
/// places between rays that end on it and rays that pass by.
PelletFit fit_pellet(const PelletScene& scene, const SolidCylinder& start, FitStart from);

}  // namespace kr5::picking
