// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/line_scanner.hpp>

#include <cmath>
#include <cstdint>
#include <limits>

#include <kr5/core/error.hpp>
#include <kr5/predict/sight.hpp>

namespace kr5::sim {

void LineScannerOptions::validate() const {
  require(points >= 2 && points <= 100000, "points: must be 2 to 100000");
  require(std::isfinite(width) && width > 0.0, "width: must be positive");
  require(near >= 0.0 && std::isfinite(far) && far > near, "far: must be more than near, and near not negative");
}

LineScanner::LineScanner(const cell::Cell& cell, std::vector<cell::Thing> things, const LineScannerOptions& options)
    : things_(std::move(things)),
      options_(options),
      effects_(cell.effects.sensors),
      sigma_(options.noise ? cell.noise.laser : 0.0),
      T_F_L_(predict::real_scanner_mount(cell)),
      random_(static_cast<std::uint64_t>(options.seed)) {
  options.validate();
  for (const cell::Thing& thing : things_) thing.validate();
  profile_.x = Eigen::VectorXd::LinSpaced(options.points, -options.width / 2, options.width / 2);
  profile_.z.resize(options.points);
  profile_.thing.resize(static_cast<std::size_t>(options.points));
}

double LineScanner::meet(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, int& thing) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < things_.size(); ++i) {
    const double distance = things_[i].meet(Ray{origin, direction}.in(things_[i].T_B_O)).distance;
    if (distance < nearest) nearest = distance, thing = static_cast<int>(i);
  }
  return nearest;
}

const Profile& LineScanner::read(const Pose& T_B_F, double speed) {
  const Pose T_B_L = T_B_F * T_F_L_;
  const Eigen::Vector3d direction = T_B_L.linear().col(2);
  for (Eigen::Index k = 0; k < profile_.x.size(); ++k) {
    int& thing = profile_.thing[static_cast<std::size_t>(k)];
    const double range =
        meet(T_B_L * Eigen::Vector3d(profile_.x[k], -speed * effects_.laser_lag, 0.0), direction, thing);
    nearest_ = std::min(nearest_, range);
    const bool seen = range >= options_.near && range <= options_.far;
    profile_.z[k] = seen ? predict::biased_range(effects_, range) + random_.normal(sigma_)
                         : std::numeric_limits<double>::quiet_NaN();
    if (!seen) thing = -1;
  }
  return profile_;
}

}  // namespace kr5::sim
