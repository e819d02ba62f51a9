// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/geometry/image_view.hpp>

namespace kr5::picking {

/// Slopes of the grey levels in part of an image, smoothed by a Gaussian of one pixel, and the contrast about each
/// pixel.
class EdgeImage {
 public:
  /// The part about `low` to `high` [px]; what lies outside the image is left out. @param reach Half side of the square
  /// whose contrast counts [px].
  EdgeImage(ImageView image, const Eigen::Vector2d& low, const Eigen::Vector2d& high, int reach);

  /// Whether slopes are known at a place, and a pixel about it.
  bool covers(const Eigen::Vector2d& pixel) const;
  /// Slope along a direction of length 1 [grey/px].
  double slope(const Eigen::Vector2d& pixel, const Eigen::Vector2d& direction) const;
  /// How far a slope stands out, 0 to 1: against the noise and the contrast about the place.
  double support(const Eigen::Vector2d& pixel, double slope, double min_edge) const;

  double noise() const { return noise_; }              ///< Of a pixel [grey].
  double slope_noise() const { return slope_noise_; }  ///< [grey/px]

 private:
  double interpolated(const Eigen::MatrixXd& of, const Eigen::Vector2d& pixel) const;

  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  Eigen::MatrixXd by_u_, by_v_, contrast_;
  double noise_ = 0.0, slope_noise_ = 0.0;
};

/// An edge along a line in the image.
struct EdgeOnLine {
  double offset = 0.0;  ///< From where the line was placed [px].
  double sigma = 0.0;   ///< From the noise of the image [px].
};

/// Places along a line through `pixel` where the slope is greatest, within `half` [px] of it.
std::vector<EdgeOnLine> edges_on_line(const EdgeImage& image, const Eigen::Vector2d& pixel,
                                      const Eigen::Vector2d& direction, double half, double min_edge);

}  // namespace kr5::picking
