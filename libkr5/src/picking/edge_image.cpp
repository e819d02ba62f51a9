// SPDX-License-Identifier: BSD-3-Clause
#include "edge_image.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <kr5/core/statistics.hpp>

namespace kr5::picking {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;

namespace {

/// A Gaussian of one pixel, and its derivative, which gives the slope of a ramp exactly.
struct EdgeKernel {
  static constexpr int half = 4;
  std::array<double, 2 * half + 1> smooth{}, slope{};
  double noise = 0.0;  ///< Of a slope, per noise of a pixel.

  EdgeKernel() {
    double sum = 0, moment = 0, squares_smooth = 0, squares_slope = 0;
    for (int k = -half; k <= half; ++k) {
      const double g = std::exp(-0.5 * k * k);
      sum += g;
      moment += k * k * g;
    }
    for (int k = -half; k <= half; ++k) {
      const double g = std::exp(-0.5 * k * k);
      const auto i = static_cast<std::size_t>(k + half);
      smooth[i] = g / sum;
      slope[i] = k * g / moment;
      squares_smooth += smooth[i] * smooth[i];
      squares_slope += slope[i] * slope[i];
    }
    noise = std::sqrt(squares_smooth * squares_slope);
  }
};

/// Along the columns of the matrix; `half` fewer rows at either end.
MatrixXd filtered(const MatrixXd& grey, const std::array<double, 2 * EdgeKernel::half + 1>& kernel) {
  const Index rows = grey.rows() - 2 * EdgeKernel::half;
  MatrixXd out = MatrixXd::Zero(rows, grey.cols());
  for (std::size_t k = 0; k < kernel.size(); ++k) out += kernel[k] * grey.middleRows(static_cast<Index>(k), rows);
  return out;
}

/// Noise of a pixel from second differences both ways, which edges and slopes hardly touch (Immerkaer 1996), by their
/// median.
double pixel_noise(const MatrixXd& grey) {
  std::vector<double> values;
  for (Index c = 1; c + 1 < grey.cols(); ++c)
    for (Index r = 1; r + 1 < grey.rows(); ++r) {
      const auto row = [&](Index k) { return grey(k, c - 1) - 2 * grey(k, c) + grey(k, c + 1); };
      values.push_back(std::abs(row(r - 1) - 2 * row(r) + row(r + 1)));
    }
  constexpr double rounding =
      0.29;  // of a grey level, without which an image without noise would have no edge too weak
  return std::max(mad_to_sigma * median(values) / 6, rounding);
}

/// Standard deviation of the grey levels in a square about each pixel.
MatrixXd local_contrast(const MatrixXd& grey, int reach) {
  MatrixXd sums = MatrixXd::Zero(grey.rows() + 1, grey.cols() + 1), squares = sums;
  const double middle = grey.mean();
  for (Index c = 0; c < grey.cols(); ++c)
    for (Index r = 0; r < grey.rows(); ++r) {
      const double g = grey(r, c) - middle;
      sums(r + 1, c + 1) = g + sums(r, c + 1) + sums(r + 1, c) - sums(r, c);
      squares(r + 1, c + 1) = g * g + squares(r, c + 1) + squares(r + 1, c) - squares(r, c);
    }
  return MatrixXd::NullaryExpr(grey.rows(), grey.cols(), [&](Index r, Index c) {
    const Index r0 = std::max<Index>(r - reach, 0), r1 = std::min<Index>(r + reach + 1, grey.rows());
    const Index c0 = std::max<Index>(c - reach, 0), c1 = std::min<Index>(c + reach + 1, grey.cols());
    const auto over = [&](const MatrixXd& m) { return m(r1, c1) - m(r0, c1) - m(r1, c0) + m(r0, c0); };
    const auto count = static_cast<double>((r1 - r0) * (c1 - c0));
    const double mean = over(sums) / count;
    return std::sqrt(std::max(0.0, over(squares) / count - mean * mean));
  });
}

}  // namespace

EdgeImage::EdgeImage(ImageView image, const Vector2d& low, const Vector2d& high, int reach) {
  static const EdgeKernel kernel;
  constexpr int half = EdgeKernel::half;
  const auto clamped = [](double x, int size) { return static_cast<Index>(std::clamp(x, 0.0, double(size))); };
  const Index u0 = clamped(std::floor(low.x()) - half, image.width), u1 = clamped(high.x() + half + 2, image.width);
  const Index v0 = clamped(std::floor(low.y()) - half, image.height), v1 = clamped(high.y() + half + 2, image.height);
  if (u1 - u0 <= 2 * half + 1 || v1 - v0 <= 2 * half + 1) return;
  const MatrixXd grey = MatrixXd::NullaryExpr(v1 - v0, u1 - u0, [&](Index r, Index c) {
    return static_cast<double>(image.at(static_cast<int>(u0 + c), static_cast<int>(v0 + r)));
  });
  noise_ = pixel_noise(grey);
  slope_noise_ = noise_ * kernel.noise;
  by_v_ = filtered(filtered(grey, kernel.slope).transpose(), kernel.smooth).transpose();
  by_u_ = filtered(filtered(grey, kernel.smooth).transpose(), kernel.slope).transpose();
  contrast_ = local_contrast(grey, reach).block(half, half, by_u_.rows(), by_u_.cols());
  origin_ = Vector2d(static_cast<double>(u0 + half), static_cast<double>(v0 + half));
}

bool EdgeImage::covers(const Vector2d& pixel) const {
  const Vector2d p = pixel - origin_;
  return p.minCoeff() >= 1 && p.x() <= static_cast<double>(by_u_.cols()) - 3 &&
         p.y() <= static_cast<double>(by_u_.rows()) - 3;
}

double EdgeImage::interpolated(const MatrixXd& of, const Vector2d& pixel) const {
  const Vector2d p = pixel - origin_;
  const double u = std::floor(p.x()), v = std::floor(p.y()), x = p.x() - u, y = p.y() - v;
  const auto c = static_cast<Index>(u), r = static_cast<Index>(v);
  return (1 - y) * ((1 - x) * of(r, c) + x * of(r, c + 1)) + y * ((1 - x) * of(r + 1, c) + x * of(r + 1, c + 1));
}

double EdgeImage::slope(const Vector2d& pixel, const Vector2d& direction) const {
  return direction.x() * interpolated(by_u_, pixel) + direction.y() * interpolated(by_v_, pixel);
}

double EdgeImage::support(const Vector2d& pixel, double slope, double min_edge) const {
  // A step of the whole contrast has this slope, for its standard deviation is half of it at most.
  const double step = 2 * interpolated(contrast_, pixel) / std::sqrt(2 * std::numbers::pi);
  const double half = std::max(min_edge * slope_noise_, 0.15 * step);
  return slope * slope / (slope * slope + half * half);
}

std::vector<EdgeOnLine> edges_on_line(const EdgeImage& image, const Vector2d& pixel, const Vector2d& direction,
                                      double half, double min_edge) {
  constexpr double step = 0.5;
  const auto at = [&](double s) { return std::abs(image.slope(pixel + s * direction, direction)); };
  std::vector<EdgeOnLine> out;
  if (!image.covers(pixel + (half + 2) * direction) || !image.covers(pixel - (half + 2) * direction)) return out;
  double before = at(-half - step), here = at(-half);
  for (double s = -half; s <= half; s += step) {
    const double after = at(s + step);
    if (here > before && here >= after && here > min_edge * image.slope_noise()) {
      EdgeOnLine edge{.offset = s};
      double curvature = 0;
      for (int k = 0; k < 2; ++k) {  // the top of the parabola through three places, twice: the second about the top
        const double left = at(edge.offset - 1), middle = at(edge.offset), right = at(edge.offset + 1);
        curvature = left - 2 * middle + right;
        if (curvature < 0) edge.offset += std::clamp(0.5 * (left - right) / curvature, -0.5, 0.5);
      }
      // The two outer slopes are two pixels apart: their noise has the correlation -exp(-1).
      if (curvature < 0) edge.sigma = 0.5 * std::sqrt(2 * (1 + std::exp(-1.0))) * image.slope_noise() / -curvature;
      if (curvature < 0 && std::abs(edge.offset) <= half) out.push_back(edge);
    }
    before = here;
    here = after;
  }
  return out;
}

}  // namespace kr5::picking
