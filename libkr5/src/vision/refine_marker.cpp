// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "vision/refine.hpp"
#include "vision/small_fit.hpp"

namespace kr5::vision {
namespace {

using Corners = Eigen::Matrix<double, 2, 4>;
// 8 of the homography, log of the blur, black, white - black, its slope along x, y, bends.
constexpr int size = 16, bends = 3;
// How the lens bends the marker: cubic distortion about the middle of the image, at half its diagonal; what distortion
// of higher order adds to that along the radius; and across it, because the lens's centre is not the image's.
constexpr int lens = 13;
// What lenses are like, for markers too small to tell: deviation of the bends (the second grows with the cube of the
// distance from the middle), middle and deviation of log blur.
constexpr double usual_lens = 0.1, usual_higher = 0.1, usual_across = 0.005, usual_blur = -0.2, blur_range = 1.0;
using Bends = Eigen::Matrix<double, 2, bends>;
using Vector = Eigen::Matrix<double, size, 1>;
constexpr double pixel_variance = 1.0 / 12;  // a pixel averages over its own square
constexpr double model_error = 0.003;        // [px] what the approximations below leave, measured without noise

/// Image to cells of the pattern: u = (g0 x + g1 y + g2) / (g6 x + g7 y + 1), v likewise, with x, y from the middle of
/// the marker in units of half its side.
struct Cell {
  Eigen::Vector2d uv;
  Eigen::Matrix2d by_xy;
  double w;  ///< denominator
};

Cell to_cell(const Vector& p, double x, double y) {
  const double w = p[6] * x + p[7] * y + 1, per_w = 1 / w;
  Cell c{{(p[0] * x + p[1] * y + p[2]) * per_w, (p[3] * x + p[4] * y + p[5]) * per_w}, {}, w};
  c.by_xy << (p[0] - p[6] * c.uv.x()) * per_w, (p[1] - p[7] * c.uv.x()) * per_w, (p[3] - p[6] * c.uv.y()) * per_w,
      (p[4] - p[7] * c.uv.y()) * per_w;
  return c;
}

/// Cell that holds a place; std::floor is a call of a function.
int cell_of(double place) {
  const int i = static_cast<int>(place);
  return i - (place < i);
}

/// Homography through four pairs of points, last entry 1.
Eigen::Matrix<double, 8, 1> through(const Corners& from, const Corners& to) {
  Eigen::Matrix<double, 8, 8> A = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> b;
  for (int i = 0; i < 4; ++i) {
    const double x = from(0, i), y = from(1, i), u = to(0, i), v = to(1, i);
    A.row(2 * i) << x, y, 1, 0, 0, 0, -u * x, -u * y;
    A.row(2 * i + 1) << 0, 0, 0, x, y, 1, -v * x, -v * y;
    b.segment<2>(2 * i) << u, v;
  }
  return A.fullPivLu().solve(b);
}

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

struct Sample {
  double x, y;  ///< Normalised.
  Bends bend;   ///< By how much a unit of each bend moves the pixel, normalised.
  double grey;
};

class MarkerModel {
 public:
  MarkerModel(ImageView image, const MarkerPattern& pattern, const Corners& corners)
      : image_(image),
        pattern_(pattern),
        centre_((image.width - 1) / 2.0, (image.height - 1) / 2.0),
        middle_(corners.rowwise().mean()) {
    half_ = 0.25 * ((corners.col(1) - corners.col(0)).norm() + (corners.col(2) - corners.col(1)).norm());
    const int rim = (pattern.cells - pattern.square) / 2;
    square_ << rim, rim + pattern.square, rim + pattern.square, rim, rim, rim, rim + pattern.square,
        rim + pattern.square;
    lowest_ = std::min(0, rim - 1);
    const Eigen::Vector2d m = middle_ - centre_;
    if (m.norm() > 1) outward_ = m.normalized();
    usual_ << usual_lens, usual_higher * std::max(std::pow(m.norm() / centre_.norm(), 3), 0.01), usual_across;
  }

  Vector start(const Corners& corners) {
    Vector p;
    p.head<8>() = through((corners.colwise() - middle_) / half_, square_);
    p[8] = usual_blur;
    p.tail<size - 9>().setZero();
    return p;
  }

  /// Chooses at most `most` pixels near edges of the pattern, and some on flat ground for the two greys; then sets the
  /// greys of `p`.
  void choose(Vector& p, const Corners& corners, double reach, int most) {
    Chosen chosen;
    const double side = 2 * half_, band = 2 * reach * side * pattern_.square;  // about half the borders are edges
    if (band > 2.5 * most)
      walk(p, reach, most, chosen);
    else
      scan(p, corners, reach, most, chosen);
    thin(chosen.edge, most);
    thin(chosen.flat, most / 10);
    if (p[10] == 0.0) set_greys(p, chosen);
    samples_ = std::move(chosen.edge);
    samples_.insert(samples_.end(), chosen.flat.begin(), chosen.flat.end());
  }

  Normal<size> sums(const Vector& p, double scale) const {
    Normal<size> out;
    const double blur = std::exp(p[8]), s = std::sqrt(blur * blur + pixel_variance) / half_;
    for (const Sample& raw : samples_) {
      const Sample sample = straight(p, raw);
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
    const double noise = std::min(scale, 4.0);  // [grey] each is one more pixel
    for (int k = 0; k < bends; ++k)
      out.add(Vector::Unit(lens + k) * noise / usual_[k], p[lens + k] * noise / usual_[k], scale);
    out.add(Vector::Unit(8) * noise / blur_range, (p[8] - usual_blur) * noise / blur_range, scale);
    return out;
  }

  RefinedMarker corners(const SmallFit<size>& fit) const {
    const Vector& p = fit.x;
    const Eigen::Matrix3d H = to_image(p);
    RefinedMarker out;
    for (int i = 0; i < 4; ++i) {
      const Sample at = place(p, H, square_.col(i));
      const Eigen::Vector2d xy = Eigen::Vector2d(at.x, at.y) + at.bend * p.tail<bends>();
      const Cell c = to_cell(p, xy.x(), xy.y());
      Eigen::Matrix<double, 2, size> by_p = Eigen::Matrix<double, 2, size>::Zero();
      by_p.leftCols<8>() << xy.x(), xy.y(), 1, 0, 0, 0, -c.uv.x() * xy.x(), -c.uv.x() * xy.y(), 0, 0, 0, xy.x(), xy.y(),
          1, -c.uv.y() * xy.x(), -c.uv.y() * xy.y();
      Eigen::Matrix<double, 2, size> J = c.by_xy.inverse() * by_p / c.w;
      J.rightCols<bends>() = at.bend;
      out.corners.col(i) = pixel_of(at);
      const double variance = (J * fit.covariance * J.transpose()).trace() / 2;
      out.sigma[i] = std::hypot(half_ * std::sqrt(variance), model_error);
    }
    return out;
  }

  double half() const { return half_; }

 private:
  struct Chosen {
    std::vector<Sample> edge, flat;
    std::vector<double> black, white;
  };

  using Segment = std::pair<Eigen::Vector2d, Eigen::Vector2d>;

  /// Keeps a pixel if it is of use.
  void look(const Vector& p, int x, int y, double reach, Chosen& chosen) const {
    Sample s = sample({x, y});
    s.grey = image_.at(x, y);
    const int kind = classify(p, s, reach);
    if (kind == 1) chosen.edge.push_back(s);
    if (kind == 2) (pattern_at(p, s) ? chosen.white : chosen.black).push_back(s.grey), chosen.flat.push_back(s);
  }

  /// Small markers: every pixel is looked at, or every so many-th.
  void scan(const Vector& p, const Corners& corners, double reach, int most, Chosen& chosen) const {
    const Eigen::Vector2d cell = (corners.rowwise().maxCoeff() - corners.rowwise().minCoeff()) / pattern_.square;
    const Eigen::Vector2d low = corners.rowwise().minCoeff() - 2.0 * cell,
                          high = corners.rowwise().maxCoeff() + 2.0 * cell;
    const int x0 = std::max(0, static_cast<int>(low.x())), x1 = std::min(image_.width - 1, static_cast<int>(high.x()));
    const int y0 = std::max(0, static_cast<int>(low.y())), y1 = std::min(image_.height - 1, static_cast<int>(high.y()));
    const int stride = std::max(1, (x1 - x0 + 1) * (y1 - y0 + 1) / (8 * most));  // far more than `most` are not needed
    for (int y = y0; y <= y1; ++y)
      for (int x = x0 + 5 * y % stride; x <= x1; x += stride) look(p, x, y, reach, chosen);
  }

  /// Large markers: pixels strewn along the edges of the pattern, and about the middles of cells.
  void walk(const Vector& p, double reach, int most, Chosen& chosen) const {
    const int low = lowest_, n = pattern_.cells - 2 * low;
    const Eigen::Matrix3d H = to_image(p);
    std::vector<Eigen::Vector2d> knot;
    for (int v = 0; v <= n; ++v)
      for (int u = 0; u <= n; ++u) knot.push_back(pixel_of(place(p, H, {low + u, low + v})));
    const auto at = [&](int u, int v) { return knot[static_cast<std::size_t>(v * (n + 1) + u)]; };
    std::vector<Segment> edges;
    std::vector<Eigen::Vector2d> wanted;
    double length = 0;
    const auto edge = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
      edges.emplace_back(a, b), length += (b - a).norm();
    };
    for (int v = 0; v < n; ++v)
      for (int u = 0; u < n; ++u) {
        const bool here = pattern_.at(low + v, low + u);
        if (u + 1 < n && pattern_.at(low + v, low + u + 1) != here) edge(at(u + 1, v), at(u + 1, v + 1));
        if (v + 1 < n && pattern_.at(low + v + 1, low + u) != here) edge(at(u, v + 1), at(u + 1, v + 1));
        const Eigen::Vector2d a = at(u, v), d = at(u + 1, v + 1) - a;
        for (int k = 0; k * n * n < most / 8; ++k) wanted.push_back(a + (0.5 + 0.1 * (k % 3 - 1)) * d);
      }
    strew(edges, length / most, reach, wanted);
    look_at(p, wanted, reach, chosen);
  }

  /// A place every `step` along the segments, at most `reach` beside them.
  static void strew(const std::vector<Segment>& segments, double step, double reach,
                    std::vector<Eigen::Vector2d>& places) {
    double across = 0, along = 0;
    for (const auto& [a, b] : segments) {
      const double l = (b - a).norm();
      const Eigen::Vector2d t = (b - a) / l, normal(-t.y(), t.x());
      for (; along < l; along += step) {
        places.push_back(a + along * t + (2 * across - 1) * reach * normal);
        across = std::fmod(across + 0.6180339887, 1.0);  // the golden section spreads them evenly
      }
      along -= l;
    }
  }

  void look_at(const Vector& p, const std::vector<Eigen::Vector2d>& places, double reach, Chosen& chosen) const {
    std::vector<int> pixels;
    for (const Eigen::Vector2d& place : places) {
      const int x = cell_of(place.x() + 0.5), y = cell_of(place.y() + 0.5);
      if (x >= 0 && y >= 0 && x < image_.width && y < image_.height) pixels.push_back(y * image_.width + x);
    }
    std::sort(pixels.begin(), pixels.end());
    pixels.erase(std::unique(pixels.begin(), pixels.end()), pixels.end());  // a pixel counts once
    for (const int pixel : pixels) look(p, pixel % image_.width, pixel / image_.width, reach, chosen);
  }

  static Eigen::Matrix3d to_image(const Vector& p) {
    Eigen::Matrix3d G;
    G << p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], 1;
    return G.inverse();
  }

  /// Where a place of the pattern lies, as bent by the lens.
  Sample place(const Vector& p, const Eigen::Matrix3d& H, const Eigen::Vector2d& uv) const {
    const Eigen::Vector2d xy = (H * uv.homogeneous()).hnormalized();
    Sample at = sample(middle_ + half_ * xy);
    for (int pass = 0; pass < 4; ++pass)  // the pixel that, made straight, lies at xy
      at = sample(middle_ + half_ * (xy - at.bend * p.tail<bends>()));
    return at;
  }

  Eigen::Vector2d pixel_of(const Sample& s) const { return middle_ + half_ * Eigen::Vector2d(s.x, s.y); }

  /// A place in the image, its grey not yet looked up.
  Sample sample(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d r = pixel - centre_, m = middle_ - centre_, d = pixel - middle_, xy = d / half_;
    Sample s{xy.x(), xy.y(), {}, 0.0};
    // Without its value and slope at the middle, which the homography has as well: what is left bends.
    s.bend.col(0) = r * r.squaredNorm() - m * m.squaredNorm() - m.squaredNorm() * d - 2 * m * m.dot(d);
    s.bend.col(0) /= centre_.squaredNorm() * half_;
    s.bend.col(1) = outward_ * std::pow(outward_.dot(xy), 2) * half_ / centre_.norm();
    s.bend.col(2) = Eigen::Vector2d(-outward_.y(), outward_.x()) * xy.squaredNorm() * half_ / centre_.norm();
    return s;
  }

  static Sample straight(const Vector& p, Sample s) {
    const Eigen::Vector2d shift = s.bend * p.tail<bends>();
    s.x += shift.x(), s.y += shift.y();
    return s;
  }

  bool pattern_at(const Vector& p, const Sample& raw) const {
    const Sample s = straight(p, raw);
    const Cell c = to_cell(p, s.x, s.y);
    return cell(c.uv.x(), c.uv.y());
  }

  /// 0: of no use, 1: within `reach` [px] of an edge, 2: on flat ground.
  int classify(const Vector& p, const Sample& raw, double reach) const {
    const Sample s = straight(p, raw);
    const Cell c = to_cell(p, s.x, s.y);
    if (!(c.w > 0.05)) return 0;
    const double du = reach / half_ * c.by_xy.row(0).norm(), dv = reach / half_ * c.by_xy.row(1).norm();
    const double u = c.uv.x(), v = c.uv.y(), low = lowest_, high = pattern_.cells - low;
    // Beyond the rim somebody else's paper begins: stay clear of it, yet keep half a cell.
    const double mu = std::min(0.5, du), mv = std::min(0.5, dv);
    if (u < low + mu || u > high - mu || v < low + mv || v > high - mv) return 0;
    const double eu = std::min(du, 1.0), ev = std::min(dv, 1.0);
    if (edge_within(u, v, eu, ev)) return 1;
    return edge_within(u, v, 2 * eu, 2 * ev) ? 0 : 2;
  }

  /// Whether the grey changes from (u, v) to a place du to either side, or dv above or below.
  bool edge_within(double u, double v, double du, double dv) const {
    const int row = cell_of(v), col = cell_of(u);
    const int left = cell_of(u - du), right = cell_of(u + du), above = cell_of(v - dv), below = cell_of(v + dv);
    if (left == right && above == below) return false;
    const bool here = pattern_.at(row, col);
    return pattern_.at(row, left) != here || pattern_.at(row, right) != here || pattern_.at(above, col) != here ||
           pattern_.at(below, col) != here;
  }

  bool cell(double u, double v) const { return pattern_.at(cell_of(v), cell_of(u)); }

  static void thin(std::vector<Sample>& list, int most) {
    const auto n = list.size(), keep = static_cast<std::size_t>(most);
    if (n <= keep) return;
    for (std::size_t i = 0; i < keep; ++i) list[i] = list[i * n / keep];
    list.resize(keep);
  }

  static void set_greys(Vector& p, Chosen& chosen) {
    const auto median = [](std::vector<double>& v) {
      std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
      return v[v.size() / 2];
    };
    double dark = 255, light = 0;
    for (const Sample& s : chosen.edge) dark = std::min(dark, s.grey), light = std::max(light, s.grey);
    if (chosen.black.size() > 8) dark = median(chosen.black);
    if (chosen.white.size() > 8) light = median(chosen.white);
    p[9] = dark;
    p[10] = std::max(light - dark, 1.0);
  }

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
  Eigen::Vector2d centre_, middle_, outward_ = Eigen::Vector2d::UnitX();  ///< Of the image, of the marker; radius.
  Eigen::Vector3d usual_;                                                 ///< Deviation of the bends.
  double half_;
  Corners square_;
  int lowest_;
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
