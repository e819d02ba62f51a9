// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/vision/marker_map.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <set>

#include <kr5/core/error.hpp>

#include "vision/markers/marker_map_stages.hpp"
#include "vision/markers/marker_map_start.hpp"

namespace kr5::vision {
namespace {

constexpr double max_turn_beside_second = 0.05;  // standard deviation of the rotation of a marker [rad]
constexpr auto remedy = "take images from nearer, tilted by 20 to 45 degrees in several directions";

/// Sightings by id, those that occur once in their image.
std::vector<std::map<int, Eigen::Matrix<double, 2, 4>>> unique_tags(std::span<const MarkerSighting> images,
                                                                    std::string* family) {
  std::vector<std::map<int, Eigen::Matrix<double, 2, 4>>> all;
  for (const MarkerSighting& image : images) {
    std::map<int, int> count;
    for (const TagDetection& tag : image.tags) {
      require(family->empty() || tag.family == *family, "marker map: all markers must be of one family, found " +
                                                            *family + " and " + tag.family + " (" + image.name + ")");
      require(tag.corners.allFinite(), "marker map: a corner in " + image.name + " is not finite");
      *family = tag.family;
      ++count[tag.id];
    }
    auto& tags = all.emplace_back();
    for (const TagDetection& tag : image.tags)
      if (count[tag.id] == 1) tags[tag.id] = tag.corners;
  }
  return all;
}

/// Groups of ids that images connect, that of the lowest id first.
std::vector<std::vector<int>> islands_of(const std::vector<std::map<int, Eigen::Matrix<double, 2, 4>>>& images) {
  std::vector<std::set<int>> groups;
  for (const auto& image : images) {
    std::set<int> joined;
    for (const auto& [id, corners] : image) joined.insert(id);
    if (joined.empty()) continue;
    std::vector<std::set<int>> rest;
    for (const auto& group : groups) {
      const bool meets = std::any_of(group.begin(), group.end(), [&](int id) { return joined.contains(id); });
      if (meets)
        joined.insert(group.begin(), group.end());
      else
        rest.push_back(group);
    }
    rest.push_back(joined);
    groups = std::move(rest);
  }
  std::vector<std::vector<int>> out;
  for (const auto& group : groups) out.emplace_back(group.begin(), group.end());
  std::sort(out.begin(), out.end());
  return out;
}

std::string describe(const std::vector<std::vector<int>>& islands) {
  std::string text;
  for (const auto& island : islands) {
    text += text.empty() ? "{" : "} {";
    for (std::size_t i = 0; i < island.size(); ++i) text += (i ? ", " : "") + std::to_string(island[i]);
  }
  return text + "}";
}

void write_images(const MapStages& stages, MarkerMapResult& result) {
  double squares = 0, corners = 0;
  const MapState state = stages.map->state();
  for (std::size_t i = 0; i < stages.weights.size(); ++i) {
    const double seen = 4.0 * static_cast<double>(stages.map->seen[i].size());
    double own = 0;
    for (const fit::FitMeasurement sighting : stages.map->seen[i])
      own += stages.map->fit.residuals(sighting).squaredNorm();
    result.T_target_camera.push_back(state.T_camera_map[i].inverse());
    result.view_rms_px.push_back(std::sqrt(own / seen));
    result.view_outlier.push_back(stages.weights[i] == 0);
    if (stages.weights[i] > 0) squares += own, corners += seen;
  }
  result.rms_px = std::sqrt(squares / corners);
}

void write_map(const MapProblem& p, const MapStages& stages, const std::vector<int>& ids,
               const MarkerMapOptions& options, MarkerMapResult& result) {
  const fit::Solution& solution = stages.result;
  result.sigma_pixel = stages.sigma;
  for (std::size_t k = 0; k < ids.size(); ++k) {
    result.target.map.push_back({ids[k], options.size, stages.map->fit.pose(stages.map->markers[k])});
    result.covariance.push_back(stages.covariance(k));
  }
  write_images(stages, result);
  result.fit = {.status = solution.fit.status == FitStatus::Converged ? FitStatus::Converged : FitStatus::MaxIterations,
                .iterations = stages.iterations,
                .final_rms = std::sqrt(solution.cost / std::max(stages.dof(), 1.0)) / stages.sigma,
                .message = std::to_string(p.markers) + " markers from " + std::to_string(p.images) + " images"};
  if (!solution.unidentifiable.empty() || solution.fit.status == FitStatus::Degenerate || stages.dof() < 1) {
    result.fit.status = FitStatus::Degenerate;
    result.fit.message = "the images do not determine the map; take more images, from other directions";
  }
}

/// Refuses a map with a second one beside it where a marker turns so freely that cost and covariance, which are those
/// of small errors, do not tell which is right: markers seen from far off and nearly from the front.
void refuse_unsteady(MarkerMapResult& result) {
  double turn = 0;
  for (const Matrix6& C : result.covariance) turn = std::max(turn, std::sqrt(C.bottomRightCorner<3, 3>().trace()));
  if (turn < max_turn_beside_second || !result.fit.usable()) return;
  char text[80];
  std::snprintf(text, sizeof text, "are near each other, and rotations are known to %.1f deg only; ",
                180 / std::numbers::pi * turn);
  result.fit.status = FitStatus::Degenerate;
  result.fit.message = "two poses of marker " + std::to_string(result.second_marker) + " " + text + remedy;
}

/// Tells another map that is near the result in its cost, by the marker that turns most, and refuses both where they
/// cannot be told apart.
void judge_rival(const MapStages& stages, const fit::pipeline::Rival<MapState>& rival, MarkerMapResult& result) {
  std::size_t most = 0;
  const auto turn = [&](std::size_t m) {
    return pose_difference(result.target.map[m].T_target_marker, rival.at.T_map_marker[m]).tail<3>().norm();
  };
  for (std::size_t m = 1; m < result.target.map.size(); ++m)
    if (turn(m) > turn(most)) most = m;
  result.second = fit::pipeline::second_minimum(result.target.map[most].T_target_marker, rival.at.T_map_marker[most],
                                                rival.best_cost, rival.cost, std::max(stages.dof(), 1.0));
  if (result.second) result.second_marker = result.target.map[most].id;
  fit::pipeline::refuse_undecided(result.second,
                                  "two poses of marker " + std::to_string(result.second_marker) + " explain the images",
                                  remedy, result.fit);
  if (result.second) refuse_unsteady(result);
}

}  // namespace

void MarkerMapOptions::validate() const {
  require(std::isfinite(size) && size > 0, "size must be positive: the side of the markers [m]");
  require(reference >= -1, "reference must be a marker id, or -1 for the lowest");
  require(std::isfinite(sigma_pixel) && sigma_pixel >= 0, "sigma_pixel must not be negative [px]; 0 means estimated");
  require(outlier_false_alarm >= 0 && outlier_false_alarm < 1, "outlier_false_alarm must lie in [0, 1) [-]");
  require(max_iterations >= 1, "max_iterations must be at least 1");
}

MarkerMapResult estimate_marker_map(std::span<const MarkerSighting> images, const Pinhole& camera,
                                    const MarkerMapOptions& options) {
  options.validate();
  camera.validate();
  MarkerMapResult result;
  result.target.kind = TargetKind::MarkerMap;
  result.target.family.clear();
  const auto tags = unique_tags(images, &result.target.family);
  result.islands = islands_of(tags);
  if (result.islands.size() != 1) {
    result.fit.message = result.islands.empty()
                             ? "no marker is seen in any image"
                             : "no image connects these groups of markers: " + describe(result.islands) +
                                   "; take images that show markers of two groups at once";
    return result;
  }
  const std::vector<int>& ids = result.islands.front();
  const auto reference = options.reference < 0 ? ids.begin() : std::find(ids.begin(), ids.end(), options.reference);
  require(reference != ids.end(), "reference: marker " + std::to_string(options.reference) + " is seen in no image");
  if (ids.size() < 2) {
    result.fit.message =
        "only marker " + std::to_string(ids.front()) + " is seen; a map needs at least two markers in one image";
    return result;
  }
  MapProblem problem{
      camera, square_corners(options.size), 0, static_cast<int>(ids.size()), static_cast<int>(reference - ids.begin()),
      {}};
  for (std::size_t i = 0; i < tags.size(); ++i) {
    if (tags[i].size() < 2) continue;  // one marker alone says nothing of the map
    for (const auto& [id, corners] : tags[i])
      problem.sightings.push_back(
          {problem.images, static_cast<int>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin()), corners});
    result.views.push_back(images[i].name);
    ++problem.images;
  }
  std::vector<MapState> starts = start_maps(problem);
  if (starts.empty()) {
    result.fit.message = "no pose explains one of the images; is the camera the right one?";
    return result;
  }
  MapStages stages(problem, std::move(starts), options);
  const auto rival = fit::pipeline::run(stages);
  write_map(problem, stages, ids, options, result);
  if (rival) judge_rival(stages, *rival, result);
  return result;
}

}  // namespace kr5::vision
