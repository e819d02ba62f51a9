// SPDX-License-Identifier: BSD-3-Clause
#include "vision/boards/find_circles.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "vision/boards/grow_grid.hpp"
#include "vision/boards/refine_point.hpp"
#include "vision/cv_view.hpp"
#include "vision/homography.hpp"

namespace kr5::vision {
namespace {

using Eigen::Vector2d;

cv::Ptr<cv::FeatureDetector> dot_detector(const cv::Mat& picture, bool dark) {
  cv::SimpleBlobDetector::Params p;
  p.minThreshold = 20;
  p.maxThreshold = 230;
  p.thresholdStep = 10;
  p.minDistBetweenBlobs = 5;
  p.minRepeatability = 3;
  p.filterByColor = true;
  p.blobColor = dark ? 0 : 255;
  p.minArea = 15;
  p.maxArea = static_cast<float>(picture.total()) / 60.0f;
  p.filterByCircularity = false;
  p.filterByInertia = true;
  p.minInertiaRatio = 0.05f;
  p.minConvexity = 0.85f;
  return cv::SimpleBlobDetector::create(p);
}

/// Dots of about one size.
std::vector<Vector2d> dots_of(const cv::Mat& picture, bool dark) {
  std::vector<cv::KeyPoint> blobs;
  dot_detector(picture, dark)->detect(picture, blobs);
  std::vector<Vector2d> dots;
  if (blobs.empty()) return dots;
  std::vector<float> sizes;
  for (const cv::KeyPoint& b : blobs) sizes.push_back(b.size);
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
  const float usual = sizes[sizes.size() / 2];
  for (const cv::KeyPoint& b : blobs)
    if (b.size > 0.4f * usual && b.size < 2.6f * usual) dots.emplace_back(b.pt.x, b.pt.y);
  return dots;
}

/// Whether steps from dot to dot hardly change along rows and columns, as those of a flat grid through any lens: dots
/// that were put into the order of another grid zigzag.
bool is_even(const PixelGrid& grid) {
  constexpr double most = 0.4;  // change of a step over the step
  const auto bent = [](const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    return (c - 2 * b + a).norm() > most * std::min((b - a).norm(), (c - b).norm());
  };
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.cols; ++c) {
      if (r + 2 < grid.rows && bent(grid.at(r, c), grid.at(r + 1, c), grid.at(r + 2, c))) return false;
      if (c + 2 < grid.cols && bent(grid.at(r, c), grid.at(r, c + 1), grid.at(r, c + 2))) return false;
    }
  return true;
}

/// Our own way from dot to dot, which stray dots do not disturb; then OpenCV's.
std::optional<PixelGrid> find_grid(ImageView image, int rows, int cols) {
  const cv::Mat picture = cv_view(image);
  const double scale = std::min(image.width, image.height) < 400 ? 2.0 : 1.0;  // small dots merge in few pixels
  cv::Mat large = picture;
  if (scale > 1) cv::resize(picture, large, {}, scale, scale, cv::INTER_CUBIC);
  const auto shrunk = [scale](const Vector2d& p) -> Vector2d { return (p.array() + 0.5) / scale - 0.5; };
  for (const bool dark : {true, false})
    if (auto grid = grow_grid(dots_of(large, dark), rows, cols)) {
      for (Vector2d& p : grid->points) p = shrunk(p);
      return grid;
    }
  std::vector<cv::Point2f> centres;
  for (const bool dark : {true, false})
    for (const int flags :
         {static_cast<int>(cv::CALIB_CB_SYMMETRIC_GRID), cv::CALIB_CB_SYMMETRIC_GRID | cv::CALIB_CB_CLUSTERING}) {
      const bool found = cv::findCirclesGrid(large, cv::Size(cols, rows), centres, flags, dot_detector(large, dark));
      if (!found || centres.size() != static_cast<std::size_t>(rows * cols)) continue;
      PixelGrid grid{rows, cols, {}};
      for (const cv::Point2f& p : centres) grid.points.push_back(shrunk({p.x, p.y}));
      if (is_even(grid)) return grid;
    }
  return std::nullopt;
}

/// Mean distance from the centre to where the grey is half-way to that of the paper [px].
double radius_of(ImageView image, const Vector2d& centre, double spacing) {
  const auto grey = [&](const Vector2d& p) {
    return static_cast<double>(image.at(std::clamp(static_cast<int>(std::lround(p.x())), 0, image.width - 1),
                                        std::clamp(static_cast<int>(std::lround(p.y())), 0, image.height - 1)));
  };
  double sum = 0;
  constexpr int rays = 12;
  for (int k = 0; k < rays; ++k) {
    const double angle = 2 * M_PI * k / rays;
    const Vector2d way(std::cos(angle), std::sin(angle));
    const double inside = grey(centre);
    double most = 0, step = 0.25 * spacing;
    for (double r = 0; r < 0.6 * spacing; r += 0.5) most = std::max(most, std::abs(grey(centre + r * way) - inside));
    for (step = 0; step < 0.6 * spacing; step += 0.25)
      if (std::abs(grey(centre + step * way) - inside) > most / 2) break;
    sum += step;
  }
  return sum / rays;
}

/// Where the centre of the circle behind an ellipse is seen: back on the plane the outline is a circle again, whose
/// centre is then sent through the camera.
Vector2d true_centre(const Eigen::Matrix3d& H, const Vector2d& centre, const Eigen::Matrix2d& Q) {
  Eigen::Matrix3d conic;
  conic << Q, -Q * centre, (-Q * centre).transpose(), centre.dot(Q * centre) - 1;
  const Eigen::Matrix3d on_plane = H.transpose() * conic * H;
  const Vector2d middle = -on_plane.topLeftCorner<2, 2>().inverse() * on_plane.topRightCorner<2, 1>();
  return (H * middle.homogeneous()).hnormalized();
}

struct Dots {
  PixelGrid grid;
  std::vector<std::optional<RefinedDot>> fits;
  double size(int r, int c) const {
    const auto& fit = fits[static_cast<std::size_t>(r * grid.cols + c)];
    return fit ? std::pow(fit->Q.determinant(), -0.25) : 0.0;
  }
};

Dots fit_dots(ImageView image, const PixelGrid& grid) {
  Dots dots{grid, {}};
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.cols; ++c) {
      const double spacing = std::min(grid.along_x(r, c).norm(), grid.along_y(r, c).norm());
      dots.fits.push_back(refine_dot(image, grid.at(r, c), radius_of(image, grid.at(r, c), spacing)));
    }
  return dots;
}

/// Which turn of the grid: the one with the bigger dot first, else the one nearest to the upper left.
PixelGrid oriented(const Dots& dots) {
  const PixelGrid& g = dots.grid;
  std::vector<double> sizes;
  for (int r = 0; r < g.rows; ++r)
    for (int c = 0; c < g.cols; ++c) sizes.push_back(dots.size(r, c));
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
  const double usual = sizes[sizes.size() / 2];
  const Vector2d* big = nullptr;
  int count = 0;
  for (const int r : {0, g.rows - 1})
    for (const int c : {0, g.cols - 1})
      if (dots.size(r, c) > 1.25 * usual) big = &g.at(r, c), ++count;
  std::vector<PixelGrid> ways = g.turned();
  std::sort(ways.begin(), ways.end(), [](const auto& a, const auto& b) { return a.at(0, 0).sum() < b.at(0, 0).sum(); });
  if (count == 1)
    for (const PixelGrid& way : ways)
      if (way.at(0, 0) == *big) return way;
  return ways.front();
}

}  // namespace

std::optional<SeenPoints> find_circles(ImageView image, const Target& target, Refinement refine) {
  const auto raw = find_grid(image, target.rows, target.cols);
  if (!raw) return std::nullopt;
  const PixelGrid grid = oriented(fit_dots(image, *raw));
  SeenPoints seen;
  for (std::size_t i = 0; i < grid.points.size(); ++i) seen.add(static_cast<int>(i), grid.points[i], 0.0);
  if (refine == Refinement::None) return seen;
  const Dots dots = fit_dots(image, grid);
  for (std::size_t i = 0; i < grid.points.size(); ++i)
    if (dots.fits[i]) seen.pixel[i] = dots.fits[i]->centre.pixel, seen.sigma[i] = dots.fits[i]->centre.sigma;
  const Eigen::Matrix2Xd plane = target_points(target).points.topRows<2>() / target.size;
  for (int pass = 0; pass < 3; ++pass) {
    const Eigen::Map<const Eigen::Matrix2Xd> pixels(seen.pixel.front().data(), 2, plane.cols());
    const Eigen::Matrix3d H = fit_homography(plane, pixels).value_or(Eigen::Matrix3d::Identity());
    for (std::size_t i = 0; i < grid.points.size(); ++i)
      if (dots.fits[i]) seen.pixel[i] = true_centre(H, dots.fits[i]->centre.pixel, dots.fits[i]->Q);
  }
  return seen;
}

bool shows_shifted_rows(ImageView image, int rows, int cols) {
  const cv::Mat picture = cv_view(image);
  std::vector<cv::Point2f> centres;
  for (const bool dark : {true, false})
    for (const cv::Size& size : {cv::Size(cols, rows), cv::Size(rows, cols)})
      if (cv::findCirclesGrid(picture, size, centres, cv::CALIB_CB_ASYMMETRIC_GRID, dot_detector(picture, dark)) ||
          cv::findCirclesGrid(picture, size, centres, cv::CALIB_CB_ASYMMETRIC_GRID | cv::CALIB_CB_CLUSTERING,
                              dot_detector(picture, dark)))
        return true;
  return false;
}

int seen_dots(ImageView image) { return static_cast<int>(dots_of(cv_view(image), true).size()); }

}  // namespace kr5::vision
