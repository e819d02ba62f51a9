// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/vision/render.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

#include "vision/rendering/render_solids.hpp"

namespace kr5::vision {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int tile = 16;  ///< [px]

/// Points that fill the unit square evenly and fall on no common row or column, so that an upright edge too is
/// averaged over all of them (Roberts' R2 sequence).
std::vector<Vector2d> sample_points(int oversampling) {
  std::vector<Vector2d> points;
  for (int k = 0; k < oversampling * oversampling; ++k) {
    double whole = 0;
    points.emplace_back(std::modf(0.5 + 0.7548776662466927 * k, &whole),
                        std::modf(0.5 + 0.5698402909980532 * k, &whole));
  }
  return points;
}

class Renderer {
 public:
  Renderer(std::vector<Surface> surfaces, std::vector<SolidSurface> solids, const Pinhole& camera, int oversampling,
           const cv::Mat1f& background)
      : surfaces_(std::move(surfaces)),
        solids_(std::move(solids)),
        camera_(camera),
        samples_(sample_points(oversampling)),
        image_(background) {}

  cv::Mat1f run() {
    for (int y = 0; y < camera_.height; y += tile)
      for (int x = 0; x < camera_.width; x += tile) render_tile(x, y);
    return image_;
  }

 private:
  /// Ray through the corner above and left of a pixel; NaN where the lens model has none.
  Vector3d corner_ray(int x, int y) const {
    const auto ray = camera_.ray({x - 0.5, y - 0.5});
    return ray ? *ray : Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  }

  /// What a tile may see: its outline, widened for the bend of the lens, meets theirs.
  Candidates candidates(int x, int y) const {
    constexpr double widen = 0.25 * tile;
    std::array<Vector3d, 4> rays;
    for (int k = 0; k < 4; ++k) {
      const double u = k % 2 ? x + tile + widen : x - widen, v = k / 2 ? y + tile + widen : y - widen;
      const auto ray = camera_.ray({u, v});
      rays[k] = ray ? *ray : Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    }
    Candidates out;
    add_solids(rays, out);
    for (const Surface& s : surfaces_) {
      int in_front = 0, left = 0, right = 0, above = 0, below = 0;
      for (const Vector3d& ray : rays) {
        const Hit h = s.hit(ray);
        in_front += !(h.depth <= 0), left += h.u<0, right += h.u> s.sheet.cols, above += h.v < 0;
        below += h.v > s.sheet.rows;
      }
      const bool missed = in_front == 0 || (in_front == 4 && (left == 4 || right == 4 || above == 4 || below == 4));
      if (!missed) out.sheets.push_back(&s);
    }
    return out;
  }

  void add_solids(const std::array<Vector3d, 4>& corners, Candidates& out) const {
    const Vector3d axis = (corners[0] + corners[1] + corners[2] + corners[3]).normalized();
    double half = 0;
    for (const Vector3d& corner : corners)
      half = std::max(half, std::acos(std::min(axis.dot(corner.normalized()), 1.0)));
    for (const SolidSurface& s : solids_)
      if (!axis.allFinite() || s.may_lie_in(axis, half)) out.solids.push_back(&s);
  }

  void render_tile(int x0, int y0) {
    const Candidates near = candidates(x0, y0);
    if (near.empty()) return;
    const int x1 = std::min(x0 + tile, camera_.width), y1 = std::min(y0 + tile, camera_.height);
    std::array<std::array<Vector3d, tile + 1>, tile + 1> rays;
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) rays[y - y0][x - x0] = corner_ray(x, y);
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) {
        const int i = y - y0, j = x - x0;
        render_pixel(near, {rays[i][j], rays[i][j + 1], rays[i + 1][j], rays[i + 1][j + 1]}, image_(y, x));
      }
  }

  void render_pixel(const Candidates& near, const std::array<Vector3d, 4>& rays, float& pixel) const {
    for (const Vector3d& ray : rays)
      if (!ray.allFinite()) return;
    bool edge = false;
    for (auto s = near.sheets.begin(); s != near.sheets.end() && !edge; ++s)
      edge = (*s)->may_have_edge({(*s)->hit(rays[0]), (*s)->hit(rays[1]), (*s)->hit(rays[2]), (*s)->hit(rays[3])});
    std::array<Seen, 4> seen;
    for (int k = 0; k < 4 && !edge; ++k) edge = (seen[k] = near.trace(rays[k])).differs(seen[0]);
    // The round outline of a solid may cross a side between two corners.
    if (!near.solids.empty())
      for (int k = 0; k < 4 && !edge; ++k)
        edge = near.trace((rays[k] + rays[std::array{1, 3, 0, 2}[k]]) / 2).differs(seen[0]);
    if (edge) return supersample(near, rays, pixel);
    if (seen[0].of != 0) pixel = (seen[0].grey + seen[1].grey + seen[2].grey + seen[3].grey) / 4;
    if (seen[0].of == 0 && seen[0].grey != nothing) pixel = seen[0].grey;
  }

  void supersample(const Candidates& near, const std::array<Vector3d, 4>& rays, float& pixel) const {
    const Vector3d right = rays[1] - rays[0], down = rays[2] - rays[0], twist = rays[3] - rays[1] - down;
    double sum = 0;
    for (const Vector2d& p : samples_) {
      const float grey = near.trace(rays[0] + p.x() * right + p.y() * down + p.x() * p.y() * twist).grey;
      sum += grey == nothing ? pixel : grey;
    }
    pixel = static_cast<float>(sum / static_cast<double>(samples_.size()));
  }

  std::vector<Surface> surfaces_;
  std::vector<SolidSurface> solids_;
  const Pinhole& camera_;
  std::vector<Vector2d> samples_;
  cv::Mat1f image_;
};

cv::Mat1f make_background(const Pinhole& camera, const RenderOptions& o, Random& random) {
  cv::Mat1f image(camera.height, camera.width, static_cast<float>(o.background));
  if (o.clutter <= 0) return image;
  for (int cells = 4; cells <= 64; cells *= 2) {  // octaves of equal strength look like a cluttered table out of focus
    cv::Mat1f noise(cells, cells), smooth;
    for (float& value : noise) value = static_cast<float>(random.normal(o.clutter / std::sqrt(5.0)));
    cv::resize(noise, smooth, image.size(), 0, 0, cv::INTER_CUBIC);
    image += smooth;
  }
  return image;
}

void light(cv::Mat1f& image, const RenderOptions& o) {
  const double half_x = image.cols / 2.0, half_y = image.rows / 2.0;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const double dx = (x + 0.5) / half_x - 1, dy = (y + 0.5) / half_y - 1;
      image(y, x) *= static_cast<float>(o.brightness * (1 + o.gradient_x * dx + o.gradient_y * dy) *
                                        (1 - o.vignetting * (dx * dx + dy * dy) / 2));
    }
}

Image quantise(const cv::Mat1f& grey, double noise, Random& random) {
  Image image(grey.cols, grey.rows);
  auto out = image.pixels.begin();
  for (const float g : grey) {
    const double value = g + (noise > 0 ? random.normal(noise) : 0.0);
    *out++ = static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
  }
  return image;
}

bool in_image(const Vector2d& p, const Pinhole& c) {
  return p.x() >= 0 && p.y() >= 0 && p.x() <= c.width - 1 && p.y() <= c.height - 1;
}

/// Normal at a point of the target: only markers of a map have their own.
Vector3d normal_at(const Target& target, int id) {
  if (target.kind != TargetKind::MarkerMap) return Vector3d::UnitZ();
  const auto marker = std::find_if(target.map.begin(), target.map.end(), [&](const auto& m) { return m.id == id / 4; });
  return marker->T_target_marker.linear().col(2);
}

}  // namespace

void RenderOptions::validate() const {
  require(oversampling >= 1 && oversampling <= 64, "render: oversampling must be 1 to 64");
  require(margin >= 0 && margin <= 100, "render: margin must be 0 to 100");
  require(dot > 0 && dot < 1 && big_dot_factor > 0, "render: dot must lie between 0 and 1, big_dot_factor above 0");
  for (const double grey : {black, white, background})
    require(grey >= 0 && grey <= 255, "render: black, white and background must be 0 to 255");
  require(clutter >= 0 && noise >= 0, "render: clutter and noise must not be negative");
  require(brightness > 0 && vignetting >= 0 && vignetting < 1,
          "render: brightness must be positive, vignetting 0 to 1");
  require(std::abs(gradient_x) < 1 && std::abs(gradient_y) < 1, "render: gradient_x and gradient_y must be within 1");
  require(blur >= 0 && blur <= 50, "render: blur must be 0 to 50 px");
}

Image render(std::span<const PlacedTarget> targets, const Pinhole& camera, const RenderOptions& options) {
  return render(targets, {}, camera, options);
}

Image render(std::span<const PlacedTarget> targets, std::span<const PlacedSolid> solids, const Pinhole& camera,
             const RenderOptions& options) {
  camera.validate();
  options.validate();
  std::vector<Surface> surfaces;
  for (const PlacedTarget& placed : targets)
    for (Sheet& sheet : sheets_of(placed, options)) surfaces.emplace_back(std::move(sheet));
  std::vector<SolidSurface> round;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    solids[i].solid.validate();
    round.emplace_back(solids[i], static_cast<int>(i));
  }
  Random random(static_cast<std::uint64_t>(options.seed));
  cv::Mat1f grey = Renderer(std::move(surfaces), std::move(round), camera, options.oversampling,
                            make_background(camera, options, random))
                       .run();
  light(grey, options);
  if (options.blur > 0) cv::GaussianBlur(grey, grey, {0, 0}, options.blur, options.blur, cv::BORDER_REPLICATE);
  return quantise(grey, options.noise, random);
}

View visible_points(const Target& target, const Pose& T_camera_target, const Pinhole& camera) {
  camera.validate();
  const TargetPoints all = target_points(target);
  std::vector<int> kept;
  std::vector<Vector2d> pixels;
  for (int k = 0; k < static_cast<int>(all.ids.size()); ++k) {
    const Vector3d p = T_camera_target * Vector3d(all.points.col(k));
    if (p.z() <= 0 || p.dot(T_camera_target.linear() * normal_at(target, all.ids[k])) <= 0) continue;
    const Vector2d pixel = camera.project(p);
    const auto ray = camera.ray(pixel);  // a point beyond the fold of the lens model is not where `project` says
    if (!in_image(pixel, camera) || !ray || (*ray - p / p.z()).norm() > 1e-6) continue;
    kept.push_back(k);
    pixels.push_back(pixel);
  }
  View view;
  view.points.resize(3, static_cast<Eigen::Index>(kept.size()));
  view.pixels.resize(2, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t i = 0; i < kept.size(); ++i) {
    view.points.col(static_cast<Eigen::Index>(i)) = all.points.col(kept[i]);
    view.pixels.col(static_cast<Eigen::Index>(i)) = pixels[i];
    view.ids.push_back(all.ids[kept[i]]);
  }
  return view;
}

Image draw_target(const Target& target, double pixels_per_metre, const RenderOptions& options) {
  require(pixels_per_metre > 0, "draw_target: pixels_per_metre must be positive");
  const Eigen::Matrix2d area = printed_area(target, options);
  const Vector2d size = pixels_per_metre * (area.col(1) - area.col(0));
  require(size.maxCoeff() < 30000, "draw_target: the image would be over 30000 px wide or high; lower the resolution");
  // A camera one metre away sees a board at `focal length` pixels a metre, without perspective when held square.
  Pinhole camera{.width = static_cast<int>(std::lround(size.x())), .height = static_cast<int>(std::lround(size.y()))};
  camera.fx = camera.fy = pixels_per_metre;
  const Vector2d centre = -pixels_per_metre * area.col(0) - Vector2d::Constant(0.5);
  camera.cx = centre.x(), camera.cy = centre.y();
  PlacedTarget placed{target, Pose::Identity()};
  placed.T_camera_target.translation().z() = 1.0;
  RenderOptions plain = options;
  plain.clutter = plain.blur = plain.noise = plain.vignetting = plain.gradient_x = plain.gradient_y = 0.0;
  plain.brightness = 1.0, plain.black = 0.0, plain.white = plain.background = 255.0;
  return render(std::span(&placed, 1), camera, plain);
}

}  // namespace kr5::vision
