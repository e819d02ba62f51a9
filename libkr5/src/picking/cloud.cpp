// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/cloud.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/geometry/pose_interpolation.hpp>

#include "length_text.hpp"

namespace kr5::picking {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

void require_rising(const std::string& name, const VectorXd& times) {
  for (Index i = 0; i < times.size(); ++i) {
    require(std::isfinite(times[i]), name + ": row " + std::to_string(i) + " is not finite");
    require(i == 0 || times[i] > times[i - 1],
            name + ": row " + std::to_string(i) + " is not later than the one before");
  }
}

/// Pose at a time within those of the poses.
Pose interpolated(const ProfileScan& scan, double time) {
  const double* first = scan.pose_times.data();
  const double* last = first + scan.pose_times.size();
  const auto after = std::clamp<std::ptrdiff_t>(std::upper_bound(first, last, time) - first, 1, last - first - 1);
  const Pose& a = scan.T_base_flange[static_cast<std::size_t>(after - 1)];
  const Pose& b = scan.T_base_flange[static_cast<std::size_t>(after)];
  const double share = (time - first[after - 1]) / (first[after] - first[after - 1]);
  return interpolate_pose(a, b, share);
}

/// Median distance between neighbours, of up to 500 of the points.
double median_spacing(const Matrix3Xd& points) {
  const Index n = points.cols();
  if (n < 2) return 0.0;
  const Vector3d low = points.rowwise().minCoeff(), extent = points.rowwise().maxCoeff() - low;
  const double cell = std::max(2 * std::sqrt(extent.x() * extent.y() / static_cast<double>(n)), 1e-6);
  const auto key = [&](double x, double y) {
    return (static_cast<std::int64_t>(std::floor(x / cell)) << 32) ^
           (static_cast<std::int64_t>(std::floor(y / cell)) & 0xffffffff);
  };
  std::unordered_map<std::int64_t, std::vector<Index>> grid;
  for (Index i = 0; i < n; ++i) grid[key(points(0, i) - low.x(), points(1, i) - low.y())].push_back(i);
  std::vector<double> nearest;
  for (Index i = 0; i < n; i += std::max<Index>(1, n / 500)) {
    double best = std::numeric_limits<double>::infinity();
    for (int dx = -1; dx <= 1; ++dx)
      for (int dy = -1; dy <= 1; ++dy) {
        const auto found = grid.find(key(points(0, i) - low.x() + dx * cell, points(1, i) - low.y() + dy * cell));
        if (found == grid.end()) continue;
        for (const Index k : found->second)
          if (k != i) best = std::min(best, (points.col(k) - points.col(i)).norm());
      }
    if (std::isfinite(best)) nearest.push_back(best);
  }
  return median(std::move(nearest));
}

CloudCheck found(CloudCheck check, CloudFinding finding, std::string message) {
  check.finding = finding;
  check.message = std::move(message);
  return check;
}

/// Extent of the middle nine tenths in each coordinate.
Vector3d spread_of(const Matrix3Xd& points) {
  Vector3d out;
  for (int k = 0; k < 3; ++k) {
    std::vector<double> values(points.row(k).begin(), points.row(k).end());
    std::sort(values.begin(), values.end());
    out[k] = values[values.size() * 95 / 100] - values[values.size() * 5 / 100];
  }
  return out;
}

}  // namespace

void Cloud::validate() const {
  require(origins.cols() <= 1 || origins.cols() == points.cols(),
          "origins: expected none, one or " + std::to_string(points.cols()) + " columns, found " +
              std::to_string(origins.cols()));
  for (Index i = 0; i < origins.cols(); ++i)
    require(origins.col(i).allFinite() || (origins.cols() > 1 && !points.col(i).allFinite()),
            "origins: column " + std::to_string(i) + " is not finite");
}

void ProfileScan::validate() const {
  require(x.rows() > 0 && x.cols() > 0, "x: no profile");
  require(z.rows() == x.rows() && z.cols() == x.cols(), "z must have the size of x");
  require(times.size() == x.rows(), "times: expected " + std::to_string(x.rows()) + " numbers, one a profile, found " +
                                        std::to_string(times.size()));
  require(T_base_flange.size() >= 2, "T_base_flange: at least two poses are needed");
  require(pose_times.size() == static_cast<Index>(T_base_flange.size()),
          "pose_times: expected " + std::to_string(T_base_flange.size()) + " numbers, one a pose, found " +
              std::to_string(pose_times.size()));
  require_rising("times", times);
  require_rising("pose_times", pose_times);
  for (std::size_t i = 0; i < T_base_flange.size(); ++i)
    require(T_base_flange[i].matrix().allFinite() && is_rotation(T_base_flange[i].linear()),
            "T_base_flange: row " + std::to_string(i) + " is no rigid motion");
  require(is_rotation(T_flange_scanner.linear()), "T_flange_scanner is no rigid motion");
  require(std::isfinite(delay), "delay must be finite [s]");
}

Cloud cloud_from_profiles(const ProfileScan& scan) {
  scan.validate();
  const double first = scan.pose_times[0], last = scan.pose_times[scan.pose_times.size() - 1];
  std::vector<Index> exposed;
  for (Index i = 0; i < scan.times.size(); ++i)
    if (const double t = scan.times[i] - scan.delay; t >= first && t <= last) exposed.push_back(i);
  require(!exposed.empty(),
          "times: no profile was exposed within the times of the poses; do both clocks count from the "
          "same instant, and is delay in seconds?");
  Cloud out;
  const Index n = scan.x.cols();
  out.points.resize(3, n * static_cast<Index>(exposed.size()));
  out.origins.resize(3, out.points.cols());
  Index column = 0;
  for (const Index i : exposed) {
    const Pose T_base_scanner = interpolated(scan, scan.times[i] - scan.delay) * scan.T_flange_scanner;
    for (Index k = 0; k < n; ++k, ++column) {
      out.points.col(column) = T_base_scanner * Vector3d(scan.x(i, k), 0, scan.z(i, k));
      out.origins.col(column) = T_base_scanner.translation();
    }
  }
  return out;
}

Cloud crop(const Cloud& cloud, const Bin& bin, double floor_margin, double wall_margin) {
  cloud.validate();
  bin.validate();
  const Pose T_bin_base = bin.T_base_bin.inverse();
  const Eigen::Vector2d half = bin.size.head<2>() / 2 - Eigen::Vector2d::Constant(wall_margin);
  std::vector<Index> kept;
  for (Index i = 0; i < cloud.points.cols(); ++i) {
    const Vector3d p = T_bin_base * cloud.points.col(i);
    if (p.allFinite() && p.z() >= floor_margin && p.z() <= bin.size.z() &&
        (p.head<2>().cwiseAbs().array() <= half.array()).all())
      kept.push_back(i);
  }
  Cloud out;
  out.points = cloud.points(Eigen::all, kept);
  out.origins = cloud.origins.cols() > 1 ? Matrix3Xd(cloud.origins(Eigen::all, kept)) : cloud.origins;
  return out;
}

CloudCheck check_cloud(const Cloud& cloud, const Bin& bin, double radius) {
  cloud.validate();
  bin.validate();
  require(radius > 0 && std::isfinite(radius), "radius must be positive [m]");
  CloudCheck out;
  std::vector<Index> finite;
  for (Index i = 0; i < cloud.points.cols(); ++i)
    if (cloud.points.col(i).allFinite()) finite.push_back(i);
  out.finite = static_cast<int>(finite.size());
  if (finite.size() < 20)
    return found(out, CloudFinding::Empty,
                 "The cloud has " + std::to_string(out.finite) + " measured points of " +
                     std::to_string(cloud.points.cols()) + "; was the laser on, and the bin within its range?");
  const Matrix3Xd points = cloud.points(Eigen::all, finite);
  const Vector3d spread = spread_of(points);
  Cloud in_metres{points / 1000, {}};
  if (spread.maxCoeff() > 50 * bin.size.maxCoeff() && crop(in_metres, bin).points.cols() > out.finite / 5)
    return found(out, CloudFinding::WrongUnit,
                 "The points spread over " + millimetres(spread.maxCoeff()) + ", the bin over " +
                     millimetres(bin.size.maxCoeff()) + ": the cloud seems to be in millimetres; divide it by 1000.");
  const Cloud within = crop(cloud, bin);
  out.inside = static_cast<int>(within.points.cols());
  out.spacing = median_spacing(within.points);
  const Pose T_bin_base = bin.T_base_bin.inverse();
  const Matrix3Xd local = T_bin_base * points;
  const Vector3d half = bin.size / 2;
  int below = 0, above = 0, aside = 0;
  for (Index i = 0; i < local.cols(); ++i) {
    const bool over_floor = std::abs(local(0, i)) < half.x() && std::abs(local(1, i)) < half.y();
    below += over_floor && local(2, i) < -0.5 * radius && local(2, i) > -bin.size.z() - 2 * radius;
    above += over_floor && local(2, i) > 0.5 * radius && local(2, i) < bin.size.z() + 2 * radius;
    aside += !over_floor;
  }
  if (below > 2 * above && below > out.finite / 50)
    return found(out, CloudFinding::UpsideDown,
                 std::to_string(below) + " points lie below the floor of the bin and " + std::to_string(above) +
                     " above it: the pose of the bin, or that of the scanner, is upside down or too high.");
  const double covered = out.inside * out.spacing * out.spacing / (bin.size.x() * bin.size.y());
  if (out.inside < 20 || (out.inside < 0.02 * out.finite && aside > 0.9 * out.finite && covered < 0.2))
    return found(out, CloudFinding::OutsideBin,
                 std::to_string(out.inside) + " of " + std::to_string(out.finite) +
                     " points lie within the bin; check T_base_bin, and the frame and the unit of the cloud.");
  int from_below = 0;
  for (Index i = 0; i < cloud.origins.cols(); ++i)
    from_below += cloud.origins.col(i).allFinite() && (T_bin_base * cloud.origins.col(i)).z() < bin.size.z() / 2;
  if (from_below > cloud.origins.cols() / 2)
    return found(out, CloudFinding::SensorBelow,
                 "The rays begin below the middle of the bin: the pose of the scanner, or the origin given, is wrong.");
  if (out.spacing > radius / 2)
    return found(out, CloudFinding::Sparse,
                 "Neighbouring points are " + millimetres(out.spacing) + " apart; cylinders of radius " +
                     millimetres(radius) + " need " + millimetres(radius / 4) + " or less. Scan with a smaller pitch.");
  if (crop(cloud, bin, radius / 2, radius / 4).points.cols() < 20)
    return found(out, CloudFinding::NoPellets, "Nothing but floor and walls: the bin is empty.");
  return found(out, CloudFinding::Good, "usable");
}

}  // namespace kr5::picking
