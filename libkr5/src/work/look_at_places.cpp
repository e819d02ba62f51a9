// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/look_at_places.hpp>

#include <algorithm>
#include <vector>

namespace kr5::work {
namespace {

constexpr double off_face = 0.0015;     // of points from the plane of a plate or face that they lie on [m]
constexpr double on_plate = 0.004;      // above a plate from which on points are of a pellet [m]
constexpr double looked_at = 0.05;      // of the part of the stand that is looked at, from its middle [m]
constexpr double beside_bore = 0.0015;  // of points in a bore from its wall, which may stand elsewhere by so much [m]
constexpr double beside_tube = 0.005;   // of points of a pellet that stands out of a tube, from its outside [m]
constexpr int enough = 30;              // points

}  // namespace

job::PlaceResult look_at_stand(const picking::Cloud& cloud, const WorkOptions& options) {
  options.validate();
  Pose T_base_stand = options.T_base_standing_seat;
  T_base_stand.translation() =
      0.5 * (options.T_base_standing_seat.translation() + options.T_base_lying_seat.translation());
  const Eigen::Matrix3Xd points = T_base_stand.inverse() * cloud.points;
  int plate = 0, above = 0;
  for (const auto& p : points.colwise()) {
    if (p.head<2>().cwiseAbs().maxCoeff() > looked_at) continue;
    plate += std::abs(p.z()) < off_face;
    above += p.z() > on_plate && p.z() < on_plate + 2 * options.pellets.max_height;
  }
  job::PlaceResult out;
  out.occupied = above >= enough;
  out.seen = out.occupied || plate >= enough;
  return out;
}

job::PlaceResult look_at_tube(const picking::Cloud& cloud, const cell::Cell& believed, const WorkOptions& options) {
  options.validate();
  const Eigen::Matrix3Xd points = options.job.places.T_base_tube.inverse() * cloud.points;
  const double bore = believed.tube->inner_radius, outer = believed.tube->outer_radius;
  int face = 0, above = 0;
  std::vector<double> depths;
  for (const auto& p : points.colwise()) {
    const double off = p.head<2>().norm();
    if (off > outer + beside_tube) continue;
    if (p.z() > off_face)
      ++above;
    else if (off < bore - beside_bore)
      depths.push_back(-p.z());
    else if (std::abs(p.z()) < off_face)
      ++face;
  }
  job::PlaceResult out;
  out.occupied = above >= enough;
  out.seen = out.occupied || face >= enough;
  if (static_cast<int>(depths.size()) < enough) return out;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  out.depth = *middle;
  return out;
}

}  // namespace kr5::work
