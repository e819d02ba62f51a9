// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/line_scanner.hpp>

#include <cmath>
#include <cstdint>
#include <limits>

#include <kr5/core/error.hpp>
#include <kr5/physics/scanner.hpp>

namespace kr5::sim {

void LineScannerOptions::validate() const {
  require(points >= 2 && points <= 100000, "points: must be 2 to 100000");
  require(std::isfinite(width) && width > 0.0, "width: must be positive");
  require(near >= 0.0 && std::isfinite(far) && far > near, "far: must be more than near, and near not negative");
}

LineScanner::LineScanner(const cell::Cell& cell, std::vector<cell::PlacedObject> objects,
                         const LineScannerOptions& options)
    : objects_(std::move(objects)),
      options_(options),
      sigma_(options.noise ? cell.noise.laser : 0.0),
      scanner_(cell),
      random_(static_cast<std::uint64_t>(options.seed)) {
  options.validate();
  for (const cell::PlacedObject& object : objects_) object.validate();
  profile_.x = Eigen::VectorXd::LinSpaced(options.points, -options.width / 2, options.width / 2);
  profile_.z.resize(options.points);
  profile_.object.resize(static_cast<std::size_t>(options.points));
}

double LineScanner::nearest_hit(const Ray& ray, int& object) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const double distance = objects_[i].intersect(ray.in(objects_[i].T_base_object)).distance;
    if (distance < nearest) nearest = distance, object = static_cast<int>(i);
  }
  return nearest;
}

const Profile& LineScanner::read(const Pose& T_base_flange, double speed) {
  const Pose T_base_scanner = T_base_flange * scanner_.T_flange_scanner();
  for (Eigen::Index k = 0; k < profile_.x.size(); ++k) {
    int& object = profile_.object[static_cast<std::size_t>(k)];
    const double range = nearest_hit(scanner_.laser_lag(T_base_scanner, profile_.x[k], speed), object);
    nearest_ = std::min(nearest_, range);
    const bool seen = range >= options_.near && range <= options_.far;
    profile_.z[k] =
        seen ? scanner_.laser_bias(range) + random_.normal(sigma_) : std::numeric_limits<double>::quiet_NaN();
    if (!seen) object = -1;
  }
  return profile_;
}

}  // namespace kr5::sim
