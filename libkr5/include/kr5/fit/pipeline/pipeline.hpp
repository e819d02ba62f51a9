// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include <kr5/fit/pipeline/sound_probability.hpp>

/// @file
/// The stages that all calibrations go through: start from several places, noise, outliers, and whether
/// another place explains the measurements as well. What is checked before and told after is each calibration's own.

namespace kr5::fit::pipeline {

/// Where a descent ended, and what it costs there.
template <class Place>
struct Minimum {
  Place at;
  double cost = std::numeric_limits<double>::infinity();  ///< [-]
};

/// The second-best minimum beside the one that was taken.
template <class Place>
struct Rival {
  Place at;
  double cost = 0.0, best_cost = 0.0;  ///< Robust, of all measurements with the noise that was found [-].
};

/// What a calibration is to have; all else is the pipeline's.
template <class Stages>
concept Calibration = requires(Stages stages, const typename Stages::Place& place) {
  { stages.starts() } -> std::same_as<std::vector<typename Stages::Place>>;
  { stages.descend(place) } -> std::same_as<Minimum<typename Stages::Place>>;  // robust; with costs that compare
  stages.begin(place);  // a robust fit there, and what it finds far off put out of the weights
  stages.find_noise();  // fits and estimates of the noise in turn, until neither moves
  { stages.probabilities() } -> std::same_as<std::vector<double>>;  // of each measurement being sound
  { stages.weights } -> std::convertible_to<std::vector<double>&>;
  { stages.fewest() } -> std::convertible_to<std::size_t>;  // measurements that stay in at least
  { stages.false_alarm() } -> std::convertible_to<double>;
};

/// One that can tell whether another place explains its measurements as well.
template <class Stages>
concept Comparing = Calibration<Stages> && requires(Stages stages, const typename Stages::Place& place) {
  { stages.place() } -> std::same_as<typename Stages::Place>;
  { stages.revisit(place) } -> std::same_as<Minimum<typename Stages::Place>>;  // robust, with the noise found, all in
  { stages.same(place, place) } -> std::same_as<bool>;
};

/// Where descents from all starts end, the cheapest first; a single start needs no choice.
template <Calibration Stages>
std::vector<Minimum<typename Stages::Place>> find_minima(Stages& stages) {
  std::vector<Minimum<typename Stages::Place>> out;
  const std::vector<typename Stages::Place> starts = stages.starts();
  if (starts.size() == 1) return {{starts.front(), 0.0}};
  for (const auto& start : starts) out.push_back(stages.descend(start));
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; });
  return out;
}

/// Noise and outliers in turn, from a place on.
template <Calibration Stages>
void settle_at(Stages& stages, const typename Stages::Place& place) {
  stages.begin(place);
  stages.find_noise();
  settle_outliers(
      stages.weights, stages.false_alarm(), stages.fewest(), [&] { return stages.probabilities(); },
      [&] { stages.find_noise(); });
}

constexpr double clearly = 1e-3;       // share of the cost by which another minimum must be lower to be gone to
constexpr std::size_t max_rivals = 4;  // minima that are looked at again with the noise that was found

/// The best of the other minima, with the noise that was found; where one turns out to be better, the calibration moves
/// there, so that it never ends at a minimum that a start is known to beat.
template <Comparing Stages>
std::optional<Rival<typename Stages::Place>> compare_minima(
    Stages& stages, const std::vector<Minimum<typename Stages::Place>>& minima) {
  using Place = typename Stages::Place;
  for (std::size_t move = 0; move <= max_rivals; ++move) {
    const Place here = stages.place();
    const auto is_here = [&](const Minimum<Place>& minimum) { return stages.same(minimum.at, here); };
    if (std::all_of(minima.begin(), minima.end(), is_here)) return std::nullopt;
    const Minimum<Place> own = stages.revisit(here);
    std::vector<Place> seen = {own.at};
    std::optional<Rival<Place>> best;
    for (const Minimum<Place>& other : minima) {
      if (seen.size() > max_rivals) break;
      const auto known = [&](const Place& place) { return stages.same(place, other.at); };
      if (std::any_of(seen.begin(), seen.end(), known)) continue;
      const Minimum<Place> again = stages.revisit(other.at);
      seen.push_back(other.at);
      if (stages.same(again.at, own.at) || !(again.cost < (best ? best->cost : again.cost + 1))) continue;
      best = {again.at, again.cost, own.cost};
    }
    if (!best || best->cost > (1 - clearly) * own.cost) return best;
    settle_at(stages, best->at);
  }
  return std::nullopt;
}

/// Runs all stages. The result is the best minimum that the starts lead to; the second best, if there is one.
template <Calibration Stages>
std::optional<Rival<typename Stages::Place>> run(Stages& stages) {
  const auto minima = find_minima(stages);
  settle_at(stages, minima.front().at);
  if constexpr (Comparing<Stages>) {
    if (minima.size() > 1) return compare_minima(stages, minima);
  }
  return std::nullopt;
}

}  // namespace kr5::fit::pipeline
