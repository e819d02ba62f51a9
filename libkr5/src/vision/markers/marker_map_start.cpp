// SPDX-License-Identifier: BSD-3-Clause
#include "vision/markers/marker_map_start.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>

#include <kr5/geometry/resection.hpp>

namespace kr5::vision {
namespace {

using Solutions = std::vector<Resection>;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

struct Starter {
  const MapProblem& p;
  std::vector<Solutions> seen;  ///< Poses of each sighting by itself: up to two.
  MapState state;

  /// Pose of the map in an image from every known marker in it.
  std::optional<Resection> camera(int image) const {
    Eigen::Matrix3Xd points(3, 0);
    Eigen::Matrix2Xd pixels(2, 0);
    for (const IndexedSighting& s : p.sightings)
      if (s.image == image && state.marker_known[at(s.marker)]) {
        points.conservativeResize(3, points.cols() + 4);
        pixels.conservativeResize(2, pixels.cols() + 4);
        points.rightCols<4>() = state.T_map_marker[at(s.marker)] * p.square;
        pixels.rightCols<4>() = s.corners;
      }
    if (points.cols() == 0) return std::nullopt;
    auto found = resect(points, pixels, p.camera);
    if (found.empty()) return std::nullopt;
    return found.front();
  }

  /// How well `marker` at T fits all images whose pose can be had from it and the known ones [px^2].
  double misfit(int marker, const Pose& T) {
    const Pose before = state.T_map_marker[at(marker)];
    state.T_map_marker[at(marker)] = T;
    state.marker_known[at(marker)] = true;
    double sum = 0;
    for (const IndexedSighting& s : p.sightings) {
      if (s.marker != marker || known_in(s.image) < 2) continue;
      const auto pose = camera(s.image);
      sum += pose ? pose->rms_px * pose->rms_px : 1e6;
    }
    state.marker_known[at(marker)] = false;
    state.T_map_marker[at(marker)] = before;
    return sum;
  }

  int known_in(int image) const {
    int count = 0;
    for (const IndexedSighting& s : p.sightings) count += s.image == image && state.marker_known[at(s.marker)];
    return count;
  }

  /// Every pose of `marker` that one image with a known marker suggests; both poses of either square are tried.
  std::vector<Pose> candidates(int marker) const {
    std::vector<Pose> all;
    for (std::size_t i = 0; i < p.sightings.size() && all.size() < 24; ++i) {
      if (p.sightings[i].marker != marker) continue;
      for (std::size_t j = 0; j < p.sightings.size() && all.size() < 24; ++j) {
        const IndexedSighting& other = p.sightings[j];
        if (other.image != p.sightings[i].image || !state.marker_known[at(other.marker)]) continue;
        for (const Resection& a : seen[i])
          for (const Resection& b : seen[j])
            all.push_back(state.T_map_marker[at(other.marker)] * b.T_camera_points.inverse() * a.T_camera_points);
      }
    }
    return all;
  }

  /// The unknown marker that most images show together with known ones; -1 when none does.
  int next() const {
    std::map<int, int> links;
    for (const IndexedSighting& s : p.sightings)
      if (!state.marker_known[at(s.marker)]) links[s.marker] += known_in(s.image);
    int best = -1, most = 0;
    for (const auto& [marker, count] : links)
      if (count > most) best = marker, most = count;
    return best;
  }
};

}  // namespace

MapState start_map(const MapProblem& p) {
  Starter start{p, {}, {}};
  for (const IndexedSighting& s : p.sightings) start.seen.push_back(resect(p.square, s.corners, p.camera));
  start.state.T_map_marker.assign(at(p.markers), Pose::Identity());
  start.state.marker_known.assign(at(p.markers), false);
  start.state.T_camera_map.assign(at(p.images), Pose::Identity());
  start.state.camera_known.assign(at(p.images), false);
  start.state.marker_known[at(p.reference)] = true;
  for (int marker = start.next(); marker >= 0; marker = start.next()) {
    double least = std::numeric_limits<double>::infinity();
    Pose best = Pose::Identity();
    for (const Pose& T : start.candidates(marker)) {
      const double misfit = start.misfit(marker, T);
      if (misfit < least) least = misfit, best = T;
    }
    start.state.T_map_marker[at(marker)] = best;
    start.state.marker_known[at(marker)] = true;
  }
  for (int i = 0; i < p.images; ++i)
    if (const auto pose = start.camera(i)) {
      start.state.T_camera_map[at(i)] = pose->T_camera_points;
      start.state.camera_known[at(i)] = true;
    }
  return start.state;
}

}  // namespace kr5::vision
