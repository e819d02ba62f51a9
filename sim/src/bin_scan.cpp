// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/bin_scan.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/pose_interpolation.hpp>

namespace kr5::sim {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr double reading_missing = std::numeric_limits<double>::quiet_NaN();

/// Pose on a path; outside its ends the motion goes on.
Pose pose_at(const ScanPath& path, double time) {
  const Index count = path.times.size();
  const double* begin = path.times.data();
  const Index k = std::clamp<Index>(std::upper_bound(begin, begin + count, time) - begin, 1, count - 1);
  const auto i = static_cast<std::size_t>(k);
  const double share = (time - path.times[k - 1]) / (path.times[k] - path.times[k - 1]);
  return interpolate_pose(path.T_base_flange[i - 1], path.T_base_flange[i], share);
}

/// One scanner at one place in the bin.
class BinLaser {
 public:
  BinLaser(const BinRays& rays, const BinScannerOptions& options, const Pose& T_bin_scanner)
      : rays_(rays),
        options_(options),
        laser_(T_bin_scanner.translation()),
        receiver_(T_bin_scanner * Vector3d(0.0, options.baseline, 0.0)),
        flat_(std::cos(options.grazing)) {}

  /// First hit of a ray, if laser and receiver see it.
  BinHit seen_hit(const Vector3d& direction) const {
    const BinHit hit = rays_.first_hit(laser_, direction);
    if (hit.surface == BinNothing || !faces_both(hit, direction)) return {};
    const Vector3d point = laser_ + hit.distance * direction, back = receiver_ - point;
    const double distance = back.norm();
    return rays_.blocked(point + 1e-7 * hit.normal, back / distance, distance) ? BinHit{} : hit;
  }

  /// What laser and receiver would see of each pellet, were it alone.
  void hits_alone(const Vector3d& direction, std::vector<BinHit>& hits) const {
    rays_.all_pellets(laser_, direction, hits);
    std::erase_if(hits, [&](const BinHit& hit) { return !faces_both(hit, direction); });
  }

  /// Whether the laser is mirrored into the receiver.
  bool blinds(const BinHit& hit, const Vector3d& direction) const {
    const Vector3d back = receiver_ - (laser_ + hit.distance * direction);
    const Vector3d mirrored = direction - 2.0 * hit.normal.dot(direction) * hit.normal;
    return mirrored.dot(back) > back.norm() * std::cos(options_.specular);
  }

 private:
  bool faces_both(const BinHit& hit, const Vector3d& direction) const {
    const Vector3d back = receiver_ - (laser_ + hit.distance * direction);
    return -hit.normal.dot(direction) >= flat_ && hit.normal.dot(back) >= flat_ * back.norm();
  }

  const BinRays& rays_;
  const BinScannerOptions& options_;
  Vector3d laser_, receiver_;
  double flat_;
};

/// Range that a hit reads, NaN for none; `surface` becomes that of a true reading [m].
double reading_of(const BinLaser& laser, const BinHit& hit, const Vector3d& direction, const BinScannerOptions& options,
                  Random& random, int& surface) {
  surface = BinNothing;
  if (hit.surface == BinNothing) return reading_missing;
  if (laser.blinds(hit, direction)) {
    if (!(random.uniform() < options.streaks)) return reading_missing;
    return hit.distance + options.streak_length * random.uniform(-1.0, 1.0);
  }
  surface = hit.surface;
  return hit.distance + random.normal(options.noise);
}

}  // namespace

void BinScannerOptions::validate() const {
  const auto positive = [](double value, const char* field) {
    require(std::isfinite(value) && value > 0.0, std::string(field) + ": must be positive");
  };
  const auto angle = [](double value, const char* field) {
    require(value >= 0.0 && value <= 1.5707, std::string(field) + ": must be 0 to 1.5707 rad");
  };
  require(points >= 2 && points <= 100000, "points: must be 2 to 100000");
  positive(width, "width"), positive(stand_off, "stand_off"), positive(pitch, "pitch"), positive(speed, "speed");
  require(near >= 0.0 && std::isfinite(far) && far > near, "far: must be more than near, and near not negative");
  require(std::isfinite(baseline) && baseline != 0.0, "baseline: must not be 0");
  require(std::isfinite(delay), "delay: must be finite");
  require(std::isfinite(noise) && noise >= 0.0, "noise: must not be negative");
  angle(grazing, "grazing"), angle(specular, "specular");
  require(streaks >= 0.0 && streaks <= 1.0, "streaks: must be 0 to 1");
  require(std::isfinite(streak_length) && streak_length >= 0.0, "streak_length: must not be negative");
  require(is_rotation(T_flange_scanner.linear()) && T_flange_scanner.matrix().allFinite(),
          "T_flange_scanner: must be a rigid motion");
}

ScanPath scan_path(const BinShape& bin, const BinScannerOptions& scanner) {
  bin.validate(), scanner.validate();
  const double length = bin.size.y() + 2.0 * bin.wall;
  const Index count = static_cast<Index>(std::floor(length / scanner.pitch)) + 1;
  require(count >= 2 && count <= 100000, "pitch: must give 2 to 100000 profiles over the bin");
  Pose T_bin_scanner = from_xyzrpy((Vector6() << 0.0, 0.0, scanner.stand_off, M_PI, 0.0, 0.0).finished());
  const Pose T_scanner_flange = scanner.T_flange_scanner.inverse();
  ScanPath out;
  out.times.resize(count);
  for (Index k = 0; k < count; ++k) {
    const double way = scanner.pitch * static_cast<double>(k);
    T_bin_scanner.translation().y() = way - 0.5 * length;
    out.times[k] = way / scanner.speed;
    out.T_base_flange.push_back(bin.T_base_bin * T_bin_scanner * T_scanner_flange);
  }
  return out;
}

BinScan scan_bin(const PelletScene& scene, const ScanPath& path, const BinScannerOptions& scanner,
                 const std::vector<SolidInBin>& solids) {
  scanner.validate();
  const Index profiles = path.times.size();
  require(profiles >= 2 && profiles == static_cast<Index>(path.T_base_flange.size()),
          "path: must have two or more times, and a pose for each");
  for (Index k = 1; k < profiles; ++k)
    require(path.times[k] > path.times[k - 1], "path: times must increase, and those of the profiles " +
                                                   std::to_string(k - 1) + " and " + std::to_string(k) + " do not");
  const BinRays rays(scene, solids);
  Random random(static_cast<std::uint64_t>(scanner.seed));
  BinScan out;
  out.times = path.times, out.T_base_flange = path.T_base_flange, out.T_flange_scanner = scanner.T_flange_scanner;
  out.x = out.z = BinScan::Rows::Constant(profiles, scanner.points, reading_missing);
  out.surface = BinScan::Numbers::Constant(profiles, scanner.points, BinNothing);
  const Pose T_bin_base = scene.bin.T_base_bin.inverse();
  const double half = 0.5 * scanner.width / scanner.stand_off;
  const Eigen::VectorXd slopes = Eigen::VectorXd::LinSpaced(scanner.points, -half, half);
  Eigen::VectorXd alone = Eigen::VectorXd::Zero(static_cast<Index>(scene.pellets.size()));
  out.seen = alone;
  std::vector<BinHit> hits;
  for (Index k = 0; k < profiles; ++k) {
    const Pose T_bin_scanner = T_bin_base * pose_at(path, path.times[k] - scanner.delay) * scanner.T_flange_scanner;
    const BinLaser laser(rays, scanner, T_bin_scanner);
    for (Index i = 0; i < slopes.size(); ++i) {
      const Vector3d ray = Vector3d(slopes[i], 0.0, 1.0).normalized(), direction = T_bin_scanner.linear() * ray;
      laser.hits_alone(direction, hits);
      for (const BinHit& hit : hits) alone[hit.surface] += 1.0;
      const BinHit hit = laser.seen_hit(direction);
      if (hit.surface >= 0) out.seen[hit.surface] += 1.0;
      int surface;
      const Vector3d point = reading_of(laser, hit, direction, scanner, random, surface) * ray;
      if (!(point.z() >= scanner.near && point.z() <= scanner.far)) continue;
      out.x(k, i) = point.x(), out.z(k, i) = point.z(), out.surface(k, i) = surface;
    }
  }
  out.seen = out.seen.cwiseQuotient(alone.cwiseMax(1.0));
  return out;
}

BinScan::Points BinScan::cloud(std::vector<int>* surfaces) const {
  Points out((z.array() == z.array()).count(), 3);
  if (surfaces) surfaces->clear();
  Index row = 0;
  for (Index k = 0; k < z.rows(); ++k) {
    const Pose T_base_scanner = T_base_flange[static_cast<std::size_t>(k)] * T_flange_scanner;
    for (Index i = 0; i < z.cols(); ++i) {
      if (std::isnan(z(k, i))) continue;
      out.row(row++) = T_base_scanner * Vector3d(x(k, i), 0.0, z(k, i));
      if (surfaces) surfaces->push_back(surface(k, i));
    }
  }
  return out;
}

BinScan::Points BinScan::origins() const {
  Points out((z.array() == z.array()).count(), 3);
  Index row = 0;
  for (Index k = 0; k < z.rows(); ++k) {
    const Vector3d laser = (T_base_flange[static_cast<std::size_t>(k)] * T_flange_scanner).translation();
    const Index readings = (z.row(k).array() == z.row(k).array()).count();
    out.middleRows(row, readings).rowwise() = laser.transpose();
    row += readings;
  }
  return out;
}

}  // namespace kr5::sim
