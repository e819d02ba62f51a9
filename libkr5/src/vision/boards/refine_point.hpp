// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <Eigen/Core>

#include <kr5/vision/image.hpp>

/// @file
/// Makes points exact to a few hundredths of a pixel by fitting a model of the grey levels around them: known pattern,
/// two greys with a slope of the light, Gaussian blur of unknown width. The blur is a parameter, so it does not pull
/// edges towards each other, and the scatter left over gives each point its standard deviation.

namespace kr5::vision {

struct RefinedPoint {
  Eigen::Vector2d pixel;  ///< [px]
  double sigma = 0.0;     ///< [px]
};

/// Corner where two black squares touch. `along_x`, `along_y`: to the neighbouring corners, which give the directions
/// of the edges; `radius` of the disc looked at [px].
std::optional<RefinedPoint> refine_saddle(ImageView image, const Eigen::Vector2d& pixel, const Eigen::Vector2d& along_x,
                                          const Eigen::Vector2d& along_y, double radius);

/// An ellipse in the image: (p - centre)^T Q (p - centre) = 1.
struct RefinedDot {
  RefinedPoint centre;
  Eigen::Matrix2d Q;  ///< [1/px^2]
};
/// Edge of a dot of about `radius` [px], fitted by an ellipse.
std::optional<RefinedDot> refine_dot(ImageView image, const Eigen::Vector2d& centre, double radius);

}  // namespace kr5::vision
