// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>

#include <kr5/calibration/circle_point.hpp>

/// @file
/// Private: the place of what was measured in the turn of one joint.

namespace kr5::calibration {

/// Measured place of the tool, or of the first point; NaN where it was not seen [m].
Eigen::Vector3d measured_place(const JointSample& sample);

/// Whether a sample contradicts the others of its turn.
bool is_outlier(const JointAxisResult& axis, std::size_t sample);

/// Where the first point, or the tool, is with a joint at home, and about how well that is known.
struct HomePlace {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< [m]
  double std = 0.0;                                 ///< [m]
};

/// By the samples of a turn about its axis that are no outliers; a turn without joint values is taken to begin at home,
/// by the angle of its first sample, even where that is an outlier. Nothing where none of them shows the first point.
std::optional<HomePlace> place_at_home(std::span<const JointSample> turn, const JointAxisResult& axis, double home);

}  // namespace kr5::calibration
