// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <vector>

#include <Eigen/LU>

#include "vision/marker_geometry.hpp"
#include "vision/refine.hpp"
#include "vision/small_fit.hpp"

namespace kr5::vision {
namespace {

using namespace marker;

constexpr double blur_range = 1.0;           // of the log of the blur, about the usual one
constexpr double pixel_variance = 1.0 / 12;  // a pixel averages over its own square
constexpr double model_error = 0.003;        // [px] what the approximations below leave, measured without noise

/// Share of one row or column of cells in a blurred point: how much of each cell it sees, and the derivatives of that
/// by the place and by the width of the blur.
struct Share {
  static constexpr int most = 14;
  int first = 0, count = 0;
  std::array<double, most> a, by_place, by_width;

  Share(double place, double width) {
    const NormalTable& normal = NormalTable::get();
    first = cell_of(place - 3.2 * width);
    count = std::min(cell_of(place + 3.2 * width) - first + 1, most);
    const double per_width = 1 / width;
    double cdf0, pdf0, z0 = (first - place) * per_width;
    normal(z0, cdf0, pdf0);
    for (int i = 0; i < count; ++i) {
      const double z1 = z0 + per_width;
      double cdf1, pdf1;
      normal(z1, cdf1, pdf1);
      const auto k = static_cast<std::size_t>(i);
      a[k] = cdf1 - cdf0;
      by_place[k] = (pdf0 - pdf1) * per_width;
      by_width[k] = (z0 * pdf0 - z1 * pdf1) * per_width;
      z0 = z1, cdf0 = cdf1, pdf0 = pdf1;
    }
  }
};

class MarkerModel {
 public:
  MarkerModel(ImageView image, const MarkerPattern& pattern, const Corners& corners)
      : image_(image), pattern_(pattern), geometry_(image, pattern, corners) {}

  Vector start(const Corners& corners) const { return geometry_.start(corners); }

  void choose(Vector& p, const Corners& corners, double reach, int most) {
    samples_ = choose_pixels(image_, pattern_, geometry_, p, corners, reach, most);
  }

  Normal<size> sums(const Vector& p, double scale) const {
    Normal<size> out;
    const double blur = std::exp(p[8]), s = std::sqrt(blur * blur + pixel_variance) / half();
    for (const Sample& raw : samples_) {
      const Sample sample = Geometry::straight(p, raw);
      const Cell c = to_cell(p, sample.x, sample.y);
      const double nu = c.by_xy.row(0).norm(), nv = c.by_xy.row(1).norm();
      if (!(c.w > 0.05) || s * nu > 2 || s * nv > 2) continue;
      double f, fu, fv, fs;
      white_share(c, s * nu, s * nv, s * s * c.by_xy.row(0).dot(c.by_xy.row(1)), f, fu, fv, fs);
      const double contrast = p[10] + p[11] * sample.x + p[12] * sample.y;
      const double model = p[9] + contrast * f;
      if (sample.grey >= 254 && model >= 254) continue;  // saturated: all that is known is "at least"
      Vector J;
      const double a = contrast * fu / c.w, b = contrast * fv / c.w, t = a * c.uv.x() + b * c.uv.y();
      const Eigen::Vector2d by_xy = contrast * c.by_xy.transpose() * Eigen::Vector2d(fu, fv);
      J << a * sample.x, a * sample.y, a, b * sample.x, b * sample.y, b, -t * sample.x, -t * sample.y,
          contrast * fs * blur * blur / (blur * blur + pixel_variance), 1.0, f, f * sample.x, f * sample.y,
          sample.bend.transpose() * by_xy;
      out.add(J, model - sample.grey, scale);
    }
    const Eigen::Vector3d& usual = geometry_.usual();
    const double noise = std::min(scale, 4.0);  // [grey] each is one more pixel
    for (int k = 0; k < bends; ++k)
      out.add(Vector::Unit(lens + k) * noise / usual[k], p[lens + k] * noise / usual[k], scale);
    out.add(Vector::Unit(8) * noise / blur_range, (p[8] - usual_blur) * noise / blur_range, scale);
    return out;
  }

  RefinedMarker corners(const SmallFit<size>& fit) const {
    const Vector& p = fit.x;
    const Eigen::Matrix3d H = Geometry::to_image(p);
    RefinedMarker out;
    for (int i = 0; i < 4; ++i) {
      const Sample at = geometry_.place(p, H, geometry_.square().col(i));
      const Eigen::Vector2d xy = Eigen::Vector2d(at.x, at.y) + at.bend * p.tail<bends>();
      const Cell c = to_cell(p, xy.x(), xy.y());
      Eigen::Matrix<double, 2, size> by_p = Eigen::Matrix<double, 2, size>::Zero();
      by_p.leftCols<8>() << xy.x(), xy.y(), 1, 0, 0, 0, -c.uv.x() * xy.x(), -c.uv.x() * xy.y(), 0, 0, 0, xy.x(), xy.y(),
          1, -c.uv.y() * xy.x(), -c.uv.y() * xy.y();
      Eigen::Matrix<double, 2, size> J = c.by_xy.inverse() * by_p / c.w;
      J.rightCols<bends>() = at.bend;
      out.corners.col(i) = geometry_.pixel_of(at);
      const double variance = (J * fit.covariance * J.transpose()).trace() / 2;
      out.sigma[i] = std::hypot(half() * std::sqrt(variance), model_error);
    }
    return out;
  }

  double half() const { return geometry_.half(); }

 private:
  /// White seen at a place, f, with its derivatives by u, v and by the logarithm of the blur. Seen from the side the
  /// blur is no longer the same along u and v and the two are correlated: two terms of Mehler's series account for it.
  void white_share(const Cell& c, double su, double sv, double uv, double& f, double& fu, double& fv,
                   double& fs) const {
    const Share a(c.uv.x(), su), b(c.uv.y(), sv);
    const double second = 0.5 * uv * uv / (su * sv);
    f = 1, fu = fv = fs = 0;
    for (int j = 0; j < b.count; ++j) {
      double row = 0, row_place = 0, row_width = 0;
      for (int i = 0; i < a.count; ++i) {
        if (pattern_.at(b.first + j, a.first + i)) continue;
        const auto k = static_cast<std::size_t>(i);
        row += a.a[k], row_place += a.by_place[k], row_width += a.by_width[k];
      }
      const auto k = static_cast<std::size_t>(j);
      f -= row * b.a[k] + uv * row_place * b.by_place[k] + second * row_width * b.by_width[k];
      fu -= row_place * b.a[k];
      fv -= row * b.by_place[k];
      fs -= su * row_width * b.a[k] + sv * row * b.by_width[k];
    }
  }

  ImageView image_;
  const MarkerPattern& pattern_;
  Geometry geometry_;
  std::vector<Sample> samples_;
};

}  // namespace

std::optional<RefinedMarker> refine_marker(ImageView image, const MarkerPattern& pattern, const Corners& corners) {
  MarkerModel model(image, pattern, corners);
  const double half = model.half();
  if (!(half > 3)) return std::nullopt;
  Vector p = model.start(corners);
  const auto sums = [&](const Vector& x, double scale) { return model.sums(x, scale); };
  const auto below = [&](double shift) {  // [px], by a step of the homography in cells
    return [=, &pattern](const Vector& step) {
      return step.head<8>().cwiseAbs().maxCoeff() * 2 * half < shift * pattern.square;
    };
  };
  model.choose(p, corners, 2.5, 300);
  SmallFit<size> fit = small_fit<size>(p, sums, below(0.1));
  if (!fit.good || !(fit.x[10] > 5)) return std::nullopt;
  RefinedMarker result = model.corners(fit);
  const double blur = std::exp(fit.x[8]);
  model.choose(fit.x, result.corners, std::clamp(2.2 * std::hypot(blur, 0.3), 1.2, 5.0), 1500);
  fit = small_fit<size>(fit.x, sums, below(0.02), std::max(fit.sigma, 0.5));
  if (!fit.good || !(fit.x[10] > 5) || fit.sigma > 0.2 * fit.x[10]) return std::nullopt;
  result = model.corners(fit);
  const double moved = (result.corners - corners).colwise().norm().maxCoeff();
  if (!(moved < std::max(2.5, 0.1 * half))) return std::nullopt;
  return result;
}

}  // namespace kr5::vision
