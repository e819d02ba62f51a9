// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/vision/find_hole.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include <opencv2/imgproc.hpp>

#include <kr5/core/error.hpp>

#include "vision/cv_view.hpp"
#include "vision/holes/hole_edge.hpp"

namespace kr5::vision {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::string mm(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f mm", 1e3 * metres);
  return text;
}

HoleDetection not_found(HoleStatus status, const std::string& why) {
  HoleDetection observation;
  observation.status = status;
  observation.message = why;
  return observation;
}

/// A rectangle of the plane, drawn square on.
struct RectifiedPlane {
  Eigen::AlignedBox2d area;  ///< [m]
  double pixel = 0.0;        ///< Width of one of its pixels [m].

  Vector2d at(double x, double y) const { return area.min() + pixel * Vector2d(x, y); }
  int cols() const { return static_cast<int>(area.sizes().x() / pixel) + 1; }
  int rows() const { return static_cast<int>(area.sizes().y() / pixel) + 1; }
};

/// What of the plane lies in the image: the box about where the rays of its border meet it. Rays that graze the plane
/// are cut at twice the camera's height from the foot of its perpendicular (63 degrees).
Eigen::AlignedBox2d seen_area(const PlaneView& view, double search) {
  const Pose T_plane_camera = view.T_camera_plane.inverse();
  const Vector3d eye = T_plane_camera.translation();
  const Vector2d foot = eye.head<2>(), reach = Vector2d::Constant(2 * eye.z());
  Eigen::AlignedBox2d area;
  constexpr int steps = 16;
  for (int k = 0; k < 4 * steps; ++k) {
    const double s = static_cast<double>(k % steps) / steps;
    const double across = view.camera.width - 1.0, down = view.camera.height - 1.0;
    const std::array<Vector2d, 4> border = {Vector2d(s * across, 0), Vector2d(across, s * down),
                                            Vector2d((1 - s) * across, down), Vector2d(0, (1 - s) * down)};
    const auto ray = view.camera.ray(border[static_cast<std::size_t>(k / steps)]);
    if (!ray) continue;
    const Vector3d direction = T_plane_camera.linear() * *ray;
    if (direction.z() < -1e-3 * direction.norm())
      area.extend(Vector2d((eye - eye.z() / direction.z() * direction).head<2>()));
    else if (direction.head<2>().norm() > 0)
      area.extend(Vector2d(foot + 4 * eye.z() * direction.head<2>().normalized()));
  }
  area = area.intersection(Eigen::AlignedBox2d(foot - reach, foot + reach));
  const Vector2d half = Vector2d::Constant(search);
  return search > 0 ? area.intersection(Eigen::AlignedBox2d(-half, half)) : area;
}

/// The sheet as the image shows it. Of a much finer image the pixels are averaged first, or edges would be jagged.
cv::Mat1b draw_square_on(const PlaneView& view, const RectifiedPlane& sheet) {
  cv::Mat source = cv_view(view.image);
  const double finer = sheet.pixel / view.pixel_at(sheet.area.center());
  const int shrink = std::max(1, static_cast<int>(finer));
  if (shrink > 1) cv::resize(source, source, {source.cols / shrink, source.rows / shrink}, 0, 0, cv::INTER_AREA);
  const double sx = static_cast<double>(source.cols) / view.image.width,
               sy = static_cast<double>(source.rows) / view.image.height;
  cv::Mat2f map(sheet.rows(), sheet.cols());
  for (int y = 0; y < map.rows; ++y)
    for (int x = 0; x < map.cols; ++x) {
      const Vector3d p = view.in_camera(sheet.at(x, y));
      const Vector2d pixel = p.z() > 0 ? view.camera.project(p) : Vector2d(-1, -1);
      map(y, x) = {static_cast<float>((pixel.x() + 0.5) * sx - 0.5), static_cast<float>((pixel.y() + 0.5) * sy - 0.5)};
    }
  cv::Mat1b drawn;
  cv::remap(source, drawn, map, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return drawn;
}

/// Circles on the plane with radii from `low` to `high` [m], best supported first. Circles beside each other are all
/// wanted: the foot of a tube that is seen from the side can look like one that is better supported than the mouth.
std::vector<PlaneCircle> hough_circles(const cv::Mat1b& drawn, const RectifiedPlane& sheet, const HoleOptions& o,
                                       double low, double high) {
  constexpr double apart = 0.5;  // centres, at least, over the radius
  std::vector<cv::Vec3f> found;
  cv::HoughCircles(drawn, found, cv::HOUGH_GRADIENT, o.accumulator_pixel, apart * o.pixels_per_radius, o.edge_threshold,
                   o.accumulator_votes, static_cast<int>(std::floor(low / sheet.pixel)),
                   static_cast<int>(std::ceil(high / sheet.pixel)));
  constexpr std::size_t most = 8;
  std::vector<PlaneCircle> circles;
  for (std::size_t i = 0; i < std::min(found.size(), most); ++i)
    circles.push_back({sheet.at(found[i][0], found[i][1]), found[i][2] * sheet.pixel});
  return circles;
}

/// What came of the circles that were measured.
struct Measured {
  std::vector<CircleEdge> right;
  std::vector<PlaneCircle> other;
  bool cut = false;

  void add(const PlaneView& view, const PlaneCircle& guess, const HoleOptions& o) {
    if (!view.shows(guess)) {
      cut = cut || std::abs(guess.radius - o.radius) < 0.15 * o.radius;
      return;
    }
    const auto edge = measure_circle(view, guess, o.min_contrast);
    if (!edge || edge->edges < o.min_seen * edge->places) return;
    if (std::abs(edge->circle.radius - o.radius) > o.radius_tolerance)
      add_other(edge->circle);
    else
      add_right(*edge, o.radius);
  }
  /// Bores do not overlap: of circles that do, the sharpest is one.
  void add_right(const CircleEdge& edge, double radius) {
    for (CircleEdge& known : right)
      if ((known.circle.centre - edge.circle.centre).norm() < radius) {
        if (edge.rms_px < known.rms_px) known = edge;
        return;
      }
    right.push_back(edge);
  }
  void add_other(const PlaneCircle& circle) {
    constexpr double same = 0.05;  // of the radius, between guesses that led to the same edge
    for (const PlaneCircle& known : other)
      if ((known.centre - circle.centre).norm() + std::abs(known.radius - circle.radius) < same * circle.radius) return;
    other.push_back(circle);
  }
  /// Edges of one image are equally sharp: where several circles pass, those that their edges fit much more roughly
  /// than the best one's were put together from edges of several things.
  void keep_sharp() {
    constexpr double rough = 5.0, blurred = 0.2;  // times the best one's RMS; of edges that no circle explains [px]
    double best = std::numeric_limits<double>::infinity();
    for (const CircleEdge& edge : right) best = std::min(best, edge.rms_px);
    std::erase_if(right, [&](const CircleEdge& edge) { return edge.rms_px > std::max(rough * best, blurred); });
  }
};

HoleDetection explain(const Measured& measured, const HoleOptions& o) {
  if (measured.cut)
    return not_found(HoleStatus::CutByBorder, "the mouth extends beyond the image; turn or move the camera towards it");
  if (measured.other.empty())
    return not_found(HoleStatus::NoCircle,
                     "no circle with a dark interior lies on the plane; check the light, the height of the plane, and "
                     "that nothing hides the bore");
  std::string seen;
  std::vector<double> radii;
  for (const PlaneCircle& circle : measured.other) {
    seen += (seen.empty() ? "" : ", ") + mm(circle.radius);
    radii.push_back(circle.radius);
  }
  HoleDetection observation = not_found(
      HoleStatus::WrongRadius, "circles of radius " + seen + ", none of " + mm(o.radius) + " within " +
                                   mm(o.radius_tolerance) + "; check the radius asked for and the height of the plane");
  observation.other_radii = radii;
  return observation;
}

HoleDetection found(const CircleEdge& edge, const PlaneView& view, const HoleOptions& o) {
  HoleDetection observation;
  observation.status = HoleStatus::Found;
  observation.T_camera_hole =
      view.T_camera_plane * Eigen::Translation3d(edge.circle.centre.x(), edge.circle.centre.y(), 0.0);
  observation.radius = edge.circle.radius;
  const Vector3d centre = observation.T_camera_hole.translation();
  const Eigen::Matrix3d R = view.T_camera_plane.linear();
  // A plane that is higher by h moves the centre along its ray, and the radius with it.
  const Vector3d by_height = centre / R.col(2).dot(centre);
  observation.covariance = R.leftCols<2>() * edge.covariance.topLeftCorner<2, 2>() * R.leftCols<2>().transpose() +
                           o.sigma_height * o.sigma_height * by_height * by_height.transpose();
  const double radius_by_height = edge.circle.radius / R.col(2).dot(centre);
  observation.sigma_radius = std::sqrt(edge.covariance(2, 2) + std::pow(o.sigma_height * radius_by_height, 2));
  observation.rms_px = edge.rms_px;
  observation.edges = edge.edges;
  observation.message = "radius " + mm(edge.circle.radius) + " at " + std::to_string(edge.edges) + " places";
  return observation;
}

}  // namespace

void HoleOptions::validate() const {
  const auto positive = [](double value, const char* field) {
    require(std::isfinite(value) && value > 0, std::string("find_hole: ") + field + " must be positive");
  };
  positive(radius, "radius [m]"), positive(radius_tolerance, "radius_tolerance [m]");
  positive(accumulator_pixel, "accumulator_pixel [px]"), positive(edge_threshold, "edge_threshold [grey]");
  positive(accumulator_votes, "accumulator_votes"), positive(min_contrast, "min_contrast [grey]");
  require(radius_tolerance < radius, "find_hole: radius_tolerance must be below radius [m]");
  require(pixels_per_radius >= 8 && pixels_per_radius <= 500, "find_hole: pixels_per_radius must be 8 to 500 [px]");
  require(min_seen > 0 && min_seen <= 1, "find_hole: min_seen must lie above 0 and not above 1");
  require(std::isfinite(search) && search >= 0, "find_hole: search must not be negative [m]; 0 means everywhere");
  require(std::isfinite(sigma_height) && sigma_height >= 0, "find_hole: sigma_height must not be negative [m]");
}

HoleDetection find_hole(ImageView image, const Pinhole& camera, const Pose& T_camera_plane,
                        const HoleOptions& options) {
  require_image(image);
  camera.validate();
  options.validate();
  require(image.width == camera.width && image.height == camera.height,
          "find_hole: image and camera must have the same size [px]");
  require(T_camera_plane.matrix().allFinite() && is_rotation(T_camera_plane.linear()),
          "find_hole: T_camera_plane must be a rigid motion");
  const PlaneView view{image, camera, T_camera_plane};
  const double height = T_camera_plane.inverse().translation().z();
  if (!(height > options.radius))
    return not_found(HoleStatus::PlaneNotSeen, "the camera stands behind the face; Z of the plane points out of it");
  const RectifiedPlane sheet{seen_area(view, options.search), options.radius / options.pixels_per_radius};
  if (sheet.area.isEmpty() || sheet.area.sizes().minCoeff() < options.radius)
    return not_found(HoleStatus::PlaneNotSeen,
                     "the image does not show the part of the plane in which the bore may lie");
  require(static_cast<double>(sheet.cols()) * sheet.rows() < 6e7,
          "find_hole: the area is too large for this radius; set `search` [m]");
  const cv::Mat1b drawn = draw_square_on(view, sheet);
  Measured measured;
  const double spread = std::max(options.radius_tolerance, 0.1 * options.radius);
  for (const PlaneCircle& c : hough_circles(drawn, sheet, options, options.radius - spread, options.radius + spread))
    measured.add(view, c, options);
  measured.keep_sharp();
  if (measured.right.size() == 1) return found(measured.right.front(), view, options);
  if (measured.right.size() > 1)
    return not_found(HoleStatus::Several, std::to_string(measured.right.size()) +
                                              " bores of this radius; set `search` around the desired one");
  for (const PlaneCircle& c : hough_circles(drawn, sheet, options, 0.3 * options.radius, 3 * options.radius))
    measured.add(view, c, options);
  return explain(measured, options);
}

}  // namespace kr5::vision
