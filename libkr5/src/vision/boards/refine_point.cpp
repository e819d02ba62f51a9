// SPDX-License-Identifier: BSD-3-Clause
#include "vision/boards/refine_point.hpp"

#include <algorithm>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "vision/grey_level_fit.hpp"
#include "vision/normal_table.hpp"

namespace kr5::vision {
namespace {

using Eigen::Vector2d;
constexpr double tolerance = 0.5;                          // [standard deviations] at which a fit ends
constexpr double saddle_error = 0.003, dot_error = 0.006;  // [px] what the models leave, measured without noise

/// Calls `visit(offset from centre, grey)` for the pixels of a disc inside the image.
template <class Visit>
void for_disc(ImageView image, const Vector2d& centre, double radius, Visit&& visit) {
  const int x0 = std::max(0, static_cast<int>(std::ceil(centre.x() - radius)));
  const int x1 = std::min(image.width - 1, static_cast<int>(std::floor(centre.x() + radius)));
  const int y0 = std::max(0, static_cast<int>(std::ceil(centre.y() - radius)));
  const int y1 = std::min(image.height - 1, static_cast<int>(std::floor(centre.y() + radius)));
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const Vector2d d(x - centre.x(), y - centre.y());
      if (d.squaredNorm() <= radius * radius) visit(d, static_cast<double>(image.at(x, y)));
    }
}

struct Greys {
  double low = 255, high = 0, mean = 0;
};
Greys greys(ImageView image, const Vector2d& centre, double radius) {
  Greys g;
  int count = 0;
  for_disc(image, centre, radius, [&](const Vector2d&, double grey) {
    g.low = std::min(g.low, grey), g.high = std::max(g.high, grey), g.mean += grey, ++count;
  });
  g.mean /= std::max(count, 1);
  return g;
}

RefinedPoint point(const Vector2d& start, const Eigen::MatrixXd& covariance, const Vector2d& shift,
                   double model_error) {
  return {start + shift, std::hypot(std::sqrt(covariance.topLeftCorner<2, 2>().trace() / 2), model_error)};
}

}  // namespace

std::optional<RefinedPoint> refine_saddle(ImageView image, const Vector2d& pixel, const Vector2d& along_x,
                                          const Vector2d& along_y, double radius) {
  // x, y, angles of the two edges' normals, log blur, middle grey, half contrast (signed), slope of the light
  constexpr int size = 9;
  using Vector = Eigen::Matrix<double, size, 1>;
  const Greys g = greys(image, pixel, radius);
  if (radius < 1.5 || g.high - g.low < 8) return std::nullopt;
  const NormalTable& normal = NormalTable::get();
  const auto equations = [&](const Vector& p, double scale) {
    NormalEquations<size> out;
    const double blur = std::exp(p[4]), s = std::sqrt(blur * blur + pixel_variance);
    const Vector2d n1(std::cos(p[2]), std::sin(p[2])), n2(std::cos(p[3]), std::sin(p[3]));
    const double both = n1.dot(n2);  // edges that are not square to each other see correlated blur
    for_disc(image, pixel, radius, [&](const Vector2d& o, double grey) {
      const Vector2d d = o - p.head<2>();
      const double a = n1.dot(d) / s, b = n2.dot(d) / s;
      double A, da, B, db;
      normal(a, A, da), normal(b, B, db);
      A = 2 * A - 1, B = 2 * B - 1;
      const double f = A * B + 4 * da * db * both * (1 + 0.5 * both * a * b);
      const double fa = 2 * da * B - 4 * a * da * db * both, fb = 2 * db * A - 4 * b * da * db * both;
      const double model = p[5] + p[6] * f + p[7] * o.x() + p[8] * o.y();
      if (grey >= 254 && model >= 254) return;
      Vector J;
      const Vector2d by_d = p[6] / s * (fa * n1 + fb * n2);
      J << -by_d, p[6] / s * fa * (n1.x() * d.y() - n1.y() * d.x()), p[6] / s * fb * (n2.x() * d.y() - n2.y() * d.x()),
          -p[6] * (fa * a + fb * b) * blur * blur / (s * s), 1, f, o.x(), o.y();
      out.add_huber(J, model - grey, huber_limit * scale);
    });
    return out;
  };
  Vector p = Vector::Zero();
  p[2] = std::atan2(along_y.x(), -along_y.y());  // normal of the edge that runs along y
  p[3] = std::atan2(along_x.x(), -along_x.y());
  p[4] = std::log(0.9);
  p[5] = (g.low + g.high) / 2;
  double correlation = 0;  // which pair of quarters is white
  for_disc(image, pixel, radius, [&](const Vector2d& o, double grey) {
    const double side =
        (std::cos(p[2]) * o.x() + std::sin(p[2]) * o.y()) * (std::cos(p[3]) * o.x() + std::sin(p[3]) * o.y());
    correlation += (side > 0 ? 1 : -1) * (grey - p[5]);
  });
  p[6] = (correlation > 0 ? 0.5 : -0.5) * (g.high - g.low);
  const auto fit = fit_grey_levels<size>(p, equations, tolerance);
  const bool sound = fit.usable && fit.x.head<2>().norm() < std::max(1.5, 0.4 * radius) && fit.x[6] * p[6] > 0 &&
                     std::abs(fit.x[6]) > 4 && fit.sigma < 0.35 * std::abs(fit.x[6]);
  if (!sound) return std::nullopt;
  return point(pixel, fit.covariance, fit.x.head<2>(), saddle_error);
}

std::optional<RefinedDot> refine_dot(ImageView image, const Vector2d& centre, double radius) {
  // x, y, the symmetric A of |A (p - c)| = 1 as three numbers, log blur, grey outside, grey inside - outside, its slope
  constexpr int size = 10;
  using Vector = Eigen::Matrix<double, size, 1>;
  const double reach = 1.35 * radius + 2;
  const Greys g = greys(image, centre, reach);
  if (radius < 1.5 || g.high - g.low < 8) return std::nullopt;
  const NormalTable& normal = NormalTable::get();
  const auto equations = [&](const Vector& p, double scale) {
    NormalEquations<size> out;
    const double blur = std::exp(p[5]), s = std::sqrt(blur * blur + pixel_variance);
    for_disc(image, centre, reach, [&](const Vector2d& o, double grey) {
      const Vector2d d = o - p.head<2>();
      const Vector2d Ad(p[2] * d.x() + p[3] * d.y(), p[3] * d.x() + p[4] * d.y());
      const double q = std::max(Ad.norm(), 1e-6);
      const Vector2d slope((p[2] * Ad.x() + p[3] * Ad.y()) / q, (p[3] * Ad.x() + p[4] * Ad.y()) / q);
      const double steep = std::max(slope.norm(), 1e-6), z = (1 - q) / (steep * s);
      double inside, density;
      normal(z, inside, density);
      const double model = p[6] + p[7] * inside + p[8] * o.x() + p[9] * o.y();
      if (grey >= 254 && model >= 254) return;
      const double k = -p[7] * density / (steep * s);  // by q
      Vector J;
      J << -k * slope, k * Ad.x() * d.x() / q, k * (Ad.x() * d.y() + Ad.y() * d.x()) / q, k * Ad.y() * d.y() / q,
          -p[7] * density * z * blur * blur / (s * s), 1, inside, o.x(), o.y();
      out.add_huber(J, model - grey, huber_limit * scale);
    });
    return out;
  };
  Vector p;
  const double middle = image.at(std::clamp(static_cast<int>(std::lround(centre.x())), 0, image.width - 1),
                                 std::clamp(static_cast<int>(std::lround(centre.y())), 0, image.height - 1));
  const double out = middle < g.mean ? g.high : g.low;
  p << 0, 0, 1 / radius, 0, 1 / radius, std::log(0.8), out, middle - out, 0, 0;
  const auto fit = fit_grey_levels<size>(p, equations, tolerance);
  Eigen::Matrix2d A;
  A << fit.x[2], fit.x[3], fit.x[3], fit.x[4];
  const bool sound = fit.usable && fit.x.head<2>().norm() < std::max(1.0, 0.4 * radius) && std::abs(fit.x[7]) > 5 &&
                     fit.sigma < 0.25 * std::abs(fit.x[7]) && A.determinant() > 0;
  if (!sound) return std::nullopt;
  return RefinedDot{point(centre, fit.covariance, fit.x.head<2>(), dot_error), A.transpose() * A};
}

}  // namespace kr5::vision
