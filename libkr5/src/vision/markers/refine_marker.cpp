// SPDX-License-Identifier: BSD-3-Clause
#include "vision/markers/refine_marker.hpp"

#include <algorithm>
#include <vector>

#include <Eigen/LU>

#include <kr5/core/linear.hpp>

#include "vision/markers/batch_sum.hpp"
#include "vision/markers/marker_pixels.hpp"
#include "vision/normal_table.hpp"

namespace kr5::vision {
namespace {

using namespace marker;

constexpr double blur_range = 1.0;         // of the log of the blur, about the usual one
constexpr double rough = 1.0, fine = 0.5;  // [standard deviations] at which the first and the second fit end
constexpr double model_error = 0.003;      // [px] what the approximations below leave, measured without noise

/// CellWeights of one row or column of cells in a blurred point: how much of each cell it sees, and the derivatives of
/// that by the place and by the width of the blur.
struct CellWeights {
  static constexpr int most = 14;
  static constexpr float reach = 3.2f;  // beyond it nothing is seen
  int first = 0, count = 0;
  std::array<float, most> a, by_place, by_width;

  CellWeights(float place, float width) {
    const NormalTable& normal = NormalTable::get();
    first = cell_of(place - reach * width);
    count = std::min(cell_of(place + reach * width) - first + 1, most);
    const float per_width = 1 / width;
    float cdf0 = 0, pdf0 = 0, z0 = 0;
    for (int i = 0; i < count; ++i) {
      float cdf1 = 1, pdf1 = 0, z1 = 0;
      if (i + 1 < count) {
        z1 = (static_cast<float>(first + i + 1) - place) * per_width;
        normal(z1, cdf1, pdf1);
      }
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
    const std::vector<Sample> samples = choose_pixels(image_, pattern_, geometry_, p, corners, reach, most);
    batches_.assign((samples.size() + lanes - 1) / lanes, {});
    for (std::size_t i = 0; i < samples.size(); ++i) batches_[i / lanes].set(static_cast<int>(i % lanes), samples[i]);
  }

  NormalEquations<size> equations(const Vector& p, double scale) const {
    BatchSum<size> sum;
    std::array<Lane, size + 1> J;
    Lane used;
    for (const Batch& batch : batches_) {
      differentiate(p.cast<float>(), batch, J, used);
      sum.add(J, used, scale);
    }
    NormalEquations<size> out = sum.result();
    const Eigen::Vector3d& usual = geometry_.usual();
    const double limit = huber_limit * scale;
    const double noise = std::min(scale, 4.0);  // [grey] each is one more pixel
    for (int k = 0; k < bends; ++k)
      out.add_huber(Vector::Unit(lens + k) * noise / usual[k], p[lens + k] * noise / usual[k], limit);
    out.add_huber(Vector::Unit(8) * noise / blur_range, (p[8] - usual_blur) * noise / blur_range, limit);
    return out;
  }

  RefinedMarker corners(const GreyLevelFit<size>& fit) const {
    const Vector& p = fit.x;
    const Eigen::Matrix3d H = Geometry::to_image(p);
    RefinedMarker out;
    Eigen::Matrix<double, 8, size> by_fit;
    for (int i = 0; i < 4; ++i) {
      const Sample at = geometry_.place(p, H, geometry_.square().col(i));
      const Eigen::Vector2d xy = Eigen::Vector2d(at.x, at.y) + at.bend * p.tail<bends>();
      const Cell c = to_cell(p, xy.x(), xy.y());
      Eigen::Matrix<double, 2, size> by_p = Eigen::Matrix<double, 2, size>::Zero();
      by_p.leftCols<8>() << xy.x(), xy.y(), 1, 0, 0, 0, -c.uv.x() * xy.x(), -c.uv.x() * xy.y(), 0, 0, 0, xy.x(), xy.y(),
          1, -c.uv.y() * xy.x(), -c.uv.y() * xy.y();
      by_p = c.by_xy.inverse() * by_p / c.w;
      by_p.rightCols<bends>() = at.bend;
      by_fit.middleRows<2>(2 * i) = half() * by_p;
      out.corners.col(i) = geometry_.pixel_of(at);
    }
    set_uncertainty(by_fit * fit.covariance * by_fit.transpose(), out);
    return out;
  }

  double half() const { return geometry_.half(); }

 private:
  static void set_uncertainty(Eigen::Matrix<double, 8, 8> covariance, RefinedMarker& out) {
    covariance.diagonal().array() += model_error * model_error;
    Eigen::Matrix<double, 8, 1> per_sigma;
    for (int i = 0; i < 4; ++i) {
      out.sigma[i] = std::sqrt(covariance.diagonal().segment<2>(2 * i).mean());
      per_sigma.segment<2>(2 * i).setConstant(1 / out.sigma[i]);
    }
    out.correlation = symmetric_eigen(per_sigma.asDiagonal() * covariance * per_sigma.asDiagonal()).values[7];
  }

  /// Some samples side by side; those missing at the end have grey `none`.
  struct Batch {
    static constexpr float none = -1;
    Lane x = Lane::Zero(), y = Lane::Zero(), grey = Lane::Constant(none);
    std::array<Lane, bends> bend_x = {x, x, x}, bend_y = bend_x;

    void set(int lane, const Sample& from) {
      x[lane] = static_cast<float>(from.x), y[lane] = static_cast<float>(from.y);
      grey[lane] = static_cast<float>(from.grey);
      for (int k = 0; k < bends; ++k) {
        bend_x[static_cast<std::size_t>(k)][lane] = static_cast<float>(from.bend(0, k));
        bend_y[static_cast<std::size_t>(k)][lane] = static_cast<float>(from.bend(1, k));
      }
    }
  };

  /// What the pattern gives at a place: white seen there, f, and its derivatives by u, v, log of the blur.
  struct PatternIntensity {
    Lane f, fu, fv, fs;
  };

  void differentiate(const Eigen::Matrix<float, size, 1>& p, const Batch& b, std::array<Lane, size + 1>& J,
                     Lane& used) const {
    const float blur = std::exp(p[8]), variance = blur * blur + static_cast<float>(pixel_variance),
                s = std::sqrt(variance) / static_cast<float>(half());
    Lane x = b.x, y = b.y;
    for (std::size_t k = 0; k < bends; ++k) {
      x += p[lens + static_cast<int>(k)] * b.bend_x[k];
      y += p[lens + static_cast<int>(k)] * b.bend_y[k];
    }
    const Lane w = p[6] * x + p[7] * y + 1.0f, per_w = 1 / w;
    const Lane u = (p[0] * x + p[1] * y + p[2]) * per_w, v = (p[3] * x + p[4] * y + p[5]) * per_w;
    const Lane ux = (p[0] - p[6] * u) * per_w, uy = (p[1] - p[7] * u) * per_w;
    const Lane vx = (p[3] - p[6] * v) * per_w, vy = (p[4] - p[7] * v) * per_w;
    const Lane su = s * (ux * ux + uy * uy).sqrt(), sv = s * (vx * vx + vy * vy).sqrt();
    used = (b.grey != Batch::none && w > 0.05f && su < 2 && sv < 2).cast<float>();
    PatternIntensity white;
    for (int i = 0; i < lanes; ++i)
      if (used[i] != 0) intensity_at(u[i], v[i], su[i], sv[i], s * s * (ux[i] * vx[i] + uy[i] * vy[i]), white, i);
    const Lane contrast = p[10] + p[11] * x + p[12] * y, model = p[9] + contrast * white.f;
    used *= 1 - (b.grey >= 254 && model >= 254).cast<float>();  // saturated: all that is known is "at least"
    const Lane a = contrast * white.fu, c = contrast * white.fv, aw = a * per_w, cw = c * per_w, t = aw * u + cw * v;
    const Lane by_x = a * ux + c * vx, by_y = a * uy + c * vy;
    J = {aw * x, aw * y, aw, cw * x, cw * y, cw, -t * x, -t * y, contrast * white.fs * (blur * blur / variance)};
    J[9].setOnes(), J[10] = white.f, J[11] = white.f * x, J[12] = white.f * y;
    for (std::size_t k = 0; k < bends; ++k) J[13 + k] = by_x * b.bend_x[k] + by_y * b.bend_y[k];
    J[size] = model - b.grey;
    for (Lane& column : J) column = (used > 0).select(column, 0.0f);
  }

  /// Seen from the side the blur is no longer the same along u and v and the two are correlated: two terms of Mehler's
  /// series account for it.
  void intensity_at(float u, float v, float su, float sv, float uv, PatternIntensity& white, int lane) const {
    const CellWeights a(u, su), b(v, sv);
    const float second = 0.5f * uv * uv / (su * sv);
    float f = 1, fu = 0, fv = 0, fs = 0;
    for (int j = 0; j < b.count; ++j) {
      float row = 0, row_place = 0, row_width = 0;
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
    white.f[lane] = f, white.fu[lane] = fu, white.fv[lane] = fv, white.fs[lane] = fs;
  }

  ImageView image_;
  const MarkerPattern& pattern_;
  Geometry geometry_;
  std::vector<Batch> batches_;
};

}  // namespace

std::optional<RefinedMarker> refine_marker(ImageView image, const MarkerPattern& pattern, const Corners& corners) {
  MarkerModel model(image, pattern, corners);
  const double half = model.half();
  if (!(half > 3)) return std::nullopt;
  Vector p = model.start(corners);
  const auto equations = [&](const Vector& x, double scale) { return model.equations(x, scale); };
  model.choose(p, corners, 2.5, 300);
  GreyLevelFit<size> fit = fit_grey_levels<size>(p, equations, rough);
  if (!fit.usable || !(fit.x[10] > 5)) return std::nullopt;
  RefinedMarker result = model.corners(fit);
  const double blur = std::exp(fit.x[8]);
  model.choose(fit.x, result.corners, std::clamp(2.2 * std::hypot(blur, 0.3), 1.2, 5.0), 1500);
  fit = fit_grey_levels<size>(fit.x, equations, fine, std::max(fit.sigma, 0.5));
  if (!fit.usable || !(fit.x[10] > 5) || fit.sigma > 0.2 * fit.x[10]) return std::nullopt;
  result = model.corners(fit);
  const double moved = (result.corners - corners).colwise().norm().maxCoeff();
  if (!(moved < std::max(2.5, 0.1 * half))) return std::nullopt;
  return result;
}

}  // namespace kr5::vision
