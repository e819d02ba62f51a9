// SPDX-License-Identifier: BSD-3-Clause
#include "vision/markers/marker_map_stages.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include <Eigen/Cholesky>

#include <kr5/core/statistics.hpp>
#include <kr5/fit/measurements/pixels.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "vision/markers/marker_map_start.hpp"

namespace kr5::vision {
namespace {

constexpr double max_noise_ratio = 3.0;   // corners of an image that miss by more than that do so for a reason
constexpr double robust_scale = 2.0;      // scale of the robust loss, in standard deviations
constexpr double min_sigma_pixel = 1e-6;  // [px]

}  // namespace

MapFit::MapFit(const MapProblem& p, const MapState& start, const std::vector<double>& weights)
    : seen(list_index(p.images)) {
  const fit::FitBlock camera = fit.add_camera("camera", p.camera);
  fit.hold(camera);
  for (const Pose& T : start.T_map_marker)
    markers.push_back(fit.add_pose("marker" + std::to_string(markers.size()), T));
  fit.hold(markers[list_index(p.reference)]);
  for (const Pose& T : start.T_camera_map)
    images.push_back(fit.add_nuisance_pose("image" + std::to_string(images.size()), T));
  for (const IndexedSighting& s : p.sightings) {
    const fit::PoseChain chain = fit::PoseChain().then(images[list_index(s.image)]).then(markers[list_index(s.marker)]);
    seen[list_index(s.image)].push_back(fit.add(fit::PixelMeasurement(chain, camera, p.square, s.corners, 1.0)));
    fit.set_weight(seen[list_index(s.image)].back(), weights[list_index(s.image)]);
  }
}

MapState MapFit::state() const {
  MapState out;
  for (const fit::FitBlock marker : markers) out.T_map_marker.push_back(fit.pose(marker));
  for (const fit::FitBlock image : images) out.T_camera_map.push_back(fit.pose(image));
  return out;
}

MapStages::MapStages(const MapProblem& problem, std::vector<MapState> starts, const MarkerMapOptions& options)
    : weights(list_index(problem.images), 1.0), problem_(problem), starts_(std::move(starts)), options_(options) {
  if (options.sigma_pixel > 0) sigma = options.sigma_pixel;
}

fit::Solution MapStages::solve(MapFit& fit, double scale) const {
  const bool rough = scale > 0;
  return fit.fit.solve({.max_iterations = options_.max_iterations,
                        .loss = scale,
                        .cost_tolerance = rough ? 1e-6 : 1e-10,
                        .uncertainty = !rough});
}

double MapStages::dof() const {
  double out = -6.0 * static_cast<double>(problem_.markers - 1);
  for (std::size_t i = 0; i < weights.size(); ++i)
    if (weights[i] > 0) out += 8.0 * static_cast<double>(map->seen[i].size()) - 6;
  return out;
}

/// The images where the map puts them, if better: one that began in its other pose would not come back by itself.
MapState MapStages::images_again(const std::vector<bool>& which) const {
  MapState out = map->state();
  for (std::size_t i = 0; i < which.size(); ++i) {
    if (!which[i]) continue;
    const auto again = camera_in_map(problem_, out, static_cast<int>(i));
    const double corners = 4.0 * static_cast<double>(map->seen[i].size());
    if (again && again->rms_px * again->rms_px * corners < squares_of(i)) out.T_camera_map[i] = again->T_camera_points;
  }
  return out;
}

double MapStages::squares_of(std::size_t image) const {
  double out = 0;
  for (const fit::FitMeasurement corners : map->seen[image]) out += map->fit.residuals(corners).squaredNorm();
  return out;
}

/// Root of the mean square of the residuals of each image [px].
std::vector<double> MapStages::rms_of_images() const {
  std::vector<double> out;
  for (std::size_t i = 0; i < map->seen.size(); ++i)
    out.push_back(std::sqrt(squares_of(i) / (8.0 * static_cast<double>(map->seen[i].size()))));
  return out;
}

/// A robust fit, whose scale is that of most images; what it finds far off is put out, the tests that follow decide.
void MapStages::begin(const MapState& from) {
  const std::vector<bool> all(weights.size(), true);
  weights.assign(weights.size(), 1.0);
  map.emplace(problem_, from, weights);
  for (int round = 0; round < 2; ++round) {
    iterations += solve(*map, robust_scale * usual_noise(rms_of_images())).fit.iterations;
    map.emplace(problem_, images_again(all), weights);
  }
  const std::vector<double> rms = rms_of_images();
  const double noise = usual_noise(rms);
  if (options_.sigma_pixel == 0) sigma = noise;
  std::vector<std::size_t> order(rms.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return rms[a] < rms[b]; });
  for (std::size_t k = order.size(); k-- > fewest();)
    if (rms[order[k]] > max_noise_ratio * noise && !needed(order[k])) weights[order[k]] = 0.0;
}

/// That of most images; not less than what is given.
double MapStages::usual_noise(const std::vector<double>& rms) const {
  return std::max({median(rms), options_.sigma_pixel, min_sigma_pixel});
}

void MapStages::find_noise() {
  std::vector<bool> out;
  for (const double weight : weights) out.push_back(weight == 0);
  map.emplace(problem_, images_again(out), weights);
  result = solve(*map, 0.0);
  iterations += result.fit.iterations;
  if (options_.sigma_pixel == 0) sigma = std::max(std::sqrt(result.cost / std::max(dof(), 1.0)), min_sigma_pixel);
}

/// Whether some marker has no connection to the others without this image.
bool MapStages::needed(std::size_t image) const {
  std::set<int> known = {problem_.reference};
  for (std::size_t before = 0; before != known.size();) {
    before = known.size();
    std::vector<bool> joined(weights.size(), false);
    for (const IndexedSighting& s : problem_.sightings)
      if (weights[list_index(s.image)] > 0 && list_index(s.image) != image && known.contains(s.marker))
        joined[list_index(s.image)] = true;
    for (const IndexedSighting& s : problem_.sightings)
      if (joined[list_index(s.image)]) known.insert(s.marker);
  }
  return known.size() < list_index(problem_.markers);
}

/// Of each image being sound. Images differ in their noise, and a given one may be too small: an image is no outlier
/// that misses by less than `max_noise_ratio` times the noise of the others.
std::vector<double> MapStages::probabilities() const {
  const double freedom = options_.sigma_pixel > 0 ? uncertainty::known_noise : std::max(dof(), 1.0);
  std::vector<double> out;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const bool used = weights[i] > 0;
    const fit::Agreement agreement = result.agreement(map->fit, map->seen[i]);
    const double squared = agreement.squared_distance, rows = agreement.dof;
    const double squares_of_others = std::max(result.cost - (used ? squared : 0.0), 0.0),
                 variance_of_others = squares_of_others / std::max(dof() - (used ? rows : 0.0), 1.0);
    const double noise = std::max(variance_of_others, options_.sigma_pixel * options_.sigma_pixel);
    const bool sound = squared < max_noise_ratio * max_noise_ratio * noise * rows || (used && needed(i));
    out.push_back(sound ? 1.0 : fit::pipeline::sound_probability(squared / (sigma * sigma), rows, used, freedom));
  }
  return out;
}

/// All images, robust, with the noise that was found.
fit::pipeline::Minimum<MapState> MapStages::revisit(const MapState& from) const {
  MapFit there(problem_, from, std::vector<double>(weights.size(), 1.0));
  const double cost = solve(there, robust_scale * sigma).cost;
  return {there.state(), cost / (sigma * sigma)};
}

Matrix6 MapStages::covariance(std::size_t marker) const {
  const int place = result.places(map->markers[marker])[0];
  if (place < 0) return Matrix6::Zero();
  return sigma * sigma * result.covariance.block<6, 6>(place, place);
}

/// Whether all markers lie within what the images leave open anyway.
bool MapStages::same(const MapState& one, const MapState& other) const {
  for (std::size_t m = 0; m < map->markers.size(); ++m) {
    Matrix6 C = covariance(m);
    if (!C.allFinite()) return true;  // no map is determined
    C.diagonal().head<3>().array() += 1e-10, C.diagonal().tail<3>().array() += 1e-8;
    const Vector6 d = pose_difference(one.T_map_marker[m], other.T_map_marker[m]);
    if (d.dot(C.ldlt().solve(d)) > uncertainty::chi_square_quantile(1 - 1e-6, 6)) return false;
  }
  return true;
}

}  // namespace kr5::vision
