// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include <kr5/fit/pipeline/pipeline.hpp>
#include <kr5/fit/problem.hpp>

#include "vision/markers/marker_map_problem.hpp"

namespace kr5::vision {

/// Poses of markers and images as a Problem, in pixels. The reference stays.
struct MapFit {
  fit::Problem fit;
  std::vector<fit::FitBlock> markers, images;
  std::vector<std::vector<fit::FitMeasurement>> seen;  ///< By image, in the order of the sightings.

  MapFit(const MapProblem& problem, const MapState& start, const std::vector<double>& weights);
  MapState state() const;
};

/// A marker map in the stages of the pipeline; a measurement is an image.
class MapStages {
 public:
  using Place = MapState;

  MapStages(const MapProblem& problem, std::vector<MapState> starts, const MarkerMapOptions& options);

  std::vector<MapState> starts() const { return starts_; }
  fit::pipeline::Minimum<MapState> descend(const MapState& from) const { return revisit(from); }
  void begin(const MapState& from);
  void find_noise();
  std::vector<double> probabilities() const;
  std::size_t fewest() const { return std::max<std::size_t>(2, (weights.size() + 1) / 2); }
  double false_alarm() const { return options_.outlier_false_alarm; }
  MapState place() const { return map->state(); }
  fit::pipeline::Minimum<MapState> revisit(const MapState& from) const;
  bool same(const MapState& one, const MapState& other) const;

  /// Covariance of a marker, right perturbation; zero of the reference.
  Matrix6 covariance(std::size_t marker) const;
  double dof() const;

  std::vector<double> weights;  ///< Of images.
  std::optional<MapFit> map;
  fit::Solution result;
  double sigma = 0.5;  ///< Standard deviation of a corner per axis, given or found [px].
  int iterations = 0;

 private:
  fit::Solution solve(MapFit& fit, double loss) const;
  MapState images_again(const std::vector<bool>& which) const;
  double squares_of(std::size_t image) const;  ///< [px^2]
  std::vector<double> rms_of_images() const;
  double usual_noise(const std::vector<double>& rms_of_images) const;
  bool needed(std::size_t image) const;

  const MapProblem& problem_;
  std::vector<MapState> starts_;
  const MarkerMapOptions& options_;
};

}  // namespace kr5::vision
