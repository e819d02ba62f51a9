// SPDX-License-Identifier: BSD-3-Clause
#include "vision/markers/marker_map_start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <kr5/geometry/resection.hpp>

namespace kr5::vision {
namespace {

using Solutions = std::vector<Resection>;

constexpr double near_map = 4.0;    // ratio of squares up to which another pose is a start, too
constexpr double other_turn = 0.1;  // beyond what noise turns the pose of a single marker [rad]
constexpr std::size_t max_alternatives = 3;

/// Pose of the map in an image from the known markers in it.
std::optional<Resection> camera_from(const MapProblem& p, const MapState& state, const std::vector<bool>& known,
                                     int image) {
  Eigen::Matrix3Xd points(3, 0);
  Eigen::Matrix2Xd pixels(2, 0);
  for (const IndexedSighting& s : p.sightings)
    if (s.image == image && known[list_index(s.marker)]) {
      points.conservativeResize(3, points.cols() + 4);
      pixels.conservativeResize(2, pixels.cols() + 4);
      points.rightCols<4>() = state.T_map_marker[list_index(s.marker)] * p.square;
      pixels.rightCols<4>() = s.corners;
    }
  if (points.cols() == 0) return std::nullopt;
  auto found = resect(points, pixels, p.camera);
  if (found.empty()) return std::nullopt;
  return found.front();
}

struct Alternative {
  int marker = 0;
  Pose T_map_marker = Pose::Identity();
  double ratio = 1.0;  ///< Of its squares to those of the pose that was taken [-].
};

/// A map that grows from the reference.
struct Starter {
  const MapProblem& p;
  std::vector<Solutions> seen;  ///< Poses of each sighting by itself: up to two.
  MapState state;
  std::vector<bool> known;  ///< By marker.
  std::vector<Alternative> alternatives = {};

  explicit Starter(const MapProblem& problem) : p(problem), known(list_index(problem.markers), false) {
    for (const IndexedSighting& s : p.sightings) seen.push_back(resect(p.square, s.corners, p.camera));
    state = {std::vector<Pose>(list_index(p.markers), Pose::Identity()),
             std::vector<Pose>(list_index(p.images), Pose::Identity())};
    known[list_index(p.reference)] = true;
  }

  /// Pose of the map in an image from every known marker in it.
  std::optional<Resection> camera(int image) const { return camera_from(p, state, known, image); }

  /// How well `marker` at T fits all images whose pose can be had from it and the known ones [px^2].
  double misfit(int marker, const Pose& T) {
    const Pose before = state.T_map_marker[list_index(marker)];
    state.T_map_marker[list_index(marker)] = T;
    known[list_index(marker)] = true;
    double sum = 0;
    for (const IndexedSighting& s : p.sightings) {
      if (s.marker != marker || known_in(s.image) < 2) continue;
      const auto pose = camera(s.image);
      sum += pose ? pose->rms_px * pose->rms_px : 1e6;
    }
    known[list_index(marker)] = false;
    state.T_map_marker[list_index(marker)] = before;
    return sum;
  }

  int known_in(int image) const {
    int count = 0;
    for (const IndexedSighting& s : p.sightings) count += s.image == image && known[list_index(s.marker)];
    return count;
  }

  /// Every pose of `marker` that one image with a known marker suggests; both poses of either square are tried.
  std::vector<Pose> candidates(int marker) const {
    std::vector<Pose> all;
    for (std::size_t i = 0; i < p.sightings.size() && all.size() < 24; ++i) {
      if (p.sightings[i].marker != marker) continue;
      for (std::size_t j = 0; j < p.sightings.size() && all.size() < 24; ++j) {
        const IndexedSighting& other = p.sightings[j];
        if (other.image != p.sightings[i].image || !known[list_index(other.marker)]) continue;
        for (const Resection& a : seen[i])
          for (const Resection& b : seen[j])
            all.push_back(state.T_map_marker[list_index(other.marker)] * b.T_camera_points.inverse() *
                          a.T_camera_points);
      }
    }
    return all;
  }

  /// The unknown marker that most images show together with known ones; -1 when none does.
  int next() const {
    std::map<int, int> links;
    for (const IndexedSighting& s : p.sightings)
      if (!known[list_index(s.marker)]) links[s.marker] += known_in(s.image);
    int best = -1, most = 0;
    for (const auto& [marker, count] : links)
      if (count > most) best = marker, most = count;
    return best;
  }

  /// Its best pose; the next best that lies apart is kept where it is near.
  Pose place(int marker) {
    std::vector<std::pair<double, Pose>> order;
    for (const Pose& T : candidates(marker)) order.emplace_back(misfit(marker, T), T);
    std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    if (order.empty()) return Pose::Identity();
    const auto& [least, best] = order.front();
    for (const auto& [squares, T] : order) {
      if (squares > near_map * least) break;
      if (pose_difference(best, T).tail<3>().norm() < other_turn) continue;
      alternatives.push_back({marker, T, squares / std::max(least, 1e-300)});
      break;
    }
    return best;
  }

  void grow(const Alternative* instead = nullptr) {
    for (int marker = next(); marker >= 0; marker = next()) {
      const bool given = instead && instead->marker == marker;
      state.T_map_marker[list_index(marker)] = given ? instead->T_map_marker : place(marker);
      known[list_index(marker)] = true;
    }
  }

  /// Places the images; the sum of their squares, infinite when no pose explains one of them [px^2].
  double place_images() {
    double sum = 0;
    for (int i = 0; i < p.images; ++i) {
      const auto pose = camera(i);
      if (!pose) return std::numeric_limits<double>::infinity();
      state.T_camera_map[list_index(i)] = pose->T_camera_points;
      sum += pose->rms_px * pose->rms_px;
    }
    return sum;
  }
};

/// Every marker in the mirror image of its pose by the plane of the reference.
void turn_over(MapState& state) {
  const Eigen::DiagonalMatrix<double, 3> mirror(1, 1, -1);
  for (Pose& T : state.T_map_marker) {
    T.linear() = Eigen::Matrix3d(mirror * T.linear() * mirror);
    T.translation().z() *= -1;
  }
}

}  // namespace

std::optional<Resection> camera_in_map(const MapProblem& problem, const MapState& state, int image) {
  return camera_from(problem, state, std::vector<bool>(state.T_map_marker.size(), true), image);
}

std::vector<MapState> start_maps(const MapProblem& p) {
  Starter first(p);
  first.grow();
  const double squares = first.place_images();
  if (!std::isfinite(squares)) return {};
  std::vector<MapState> out = {first.state};
  const auto add = [&](Starter& other) {
    if (other.place_images() < near_map * squares) out.push_back(other.state);
  };
  Starter mirrored = first;
  turn_over(mirrored.state);
  add(mirrored);
  std::stable_sort(first.alternatives.begin(), first.alternatives.end(),
                   [](const Alternative& a, const Alternative& b) { return a.ratio < b.ratio; });
  for (std::size_t k = 0; k < std::min(first.alternatives.size(), max_alternatives); ++k) {
    Starter other(p);
    other.grow(&first.alternatives[k]);
    add(other);
  }
  return out;
}

}  // namespace kr5::vision
