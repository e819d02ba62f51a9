// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <Eigen/Core>

#include <kr5/vision/family.hpp>
#include <kr5/vision/image.hpp>

/// @file
/// Makes points exact to a few hundredths of a pixel by fitting a model of the grey levels around them: known pattern,
/// two greys with a slope of the light, Gaussian blur of unknown width. The blur is a parameter, so it does not pull
/// edges towards each other, and the scatter left over gives each point its standard deviation.

namespace kr5::vision {

struct RefinedMarker {
  Eigen::Matrix<double, 2, 4> corners;  ///< [px]
  Eigen::Vector4d sigma;                ///< [px]
  double correlation = 1.0;             ///< As in TagDetection [-].
};

/// The four corners of a marker, from the grey levels at all its edges, inner ones too. Empty when the marker in the
/// image does not look like `pattern`, or the corners would move farther than the first guess can be wrong.
std::optional<RefinedMarker> refine_marker(ImageView image, const MarkerPattern& pattern,
                                           const Eigen::Matrix<double, 2, 4>& corners);

}  // namespace kr5::vision
