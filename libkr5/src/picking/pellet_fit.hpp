// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/picking/pellets.hpp>

#include "ray_grid.hpp"
#include "solid_cylinder.hpp"

namespace kr5::picking {

/// What the rays say of a cylinder.
struct RayVerdict {
  int on = 0;       ///< End on it.
  int before = 0;   ///< Would meet it, but end before: something hides it.
  int close = 0;    ///< Of those, the ones that end just before: its surface should have been there.
  int through = 0;  ///< Pass through it.
  int new_on = 0;   ///< End on it and on no cylinder that was found before.

  double exposed() const { return on == 0 ? 0.0 : on / static_cast<double>(on + before + through); }
  double crossed() const { return on + through == 0 ? 1.0 : through / static_cast<double>(on + through); }
  double score() const { return on - 3.0 * through - close; }
};

/// Rays, what is known of the cylinders, and which points have been explained.
struct PelletScene {
  const PelletOptions& options;
  const RayGrid& rays;          ///< Those that are used: fewer while hypotheses are compared, all for the last fit.
  std::vector<bool> explained;  ///< By column of the cloud.
  double noise = 0.0;           ///< [m]

  /// Distance from a surface up to which a point may belong to it [m].
  double tolerance() const { return std::max(4 * noise, 0.04 * options.radius); }
  /// Depth under a surface from which a ray has passed through it [m].
  double depth() const { return std::max(6 * noise, 0.1 * options.radius); }
  double middle_height() const { return (options.min_height + options.max_height) / 2; }
};

RayVerdict judge(const PelletScene& scene, const SolidCylinder& cylinder);

struct PelletFit {
  SolidCylinder cylinder;
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Identity();
  RayVerdict verdict;
  int side = 0, face = 0, edges = 0;  ///< Observations.
  double rms = 0.0;                   ///< Distance of the points [m].
};

/// The cylinder of least squared distances near `start`: its side and ends to the points on them, its edges to the
/// places between rays that end on it and rays that pass by.
PelletFit fit_pellet(const PelletScene& scene, const SolidCylinder& start);

}  // namespace kr5::picking
