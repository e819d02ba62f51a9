// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <kr5/fit/pipeline/pipeline.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/cell_calibration/cell_problem.hpp"

/// @file
/// Private: the stages of calibrate_cell.

namespace kr5::calibration::cell_calibration {

HandEyeOptions hand_eye_options(const CellCalibrationOptions& options);

/// The stops as a cell of other geometry would have seen them: points by its map, robot poses by its arm.
std::vector<HandEyeView> views_in(std::span<const CellStop> stops, const CellGeometry& believed,
                                  const CellGeometry& cell);

/// Standard deviations from which the calibration begins.
CellSigmas cell_sigmas(const HandEyeResult& start, const CellCalibrationOptions& options);

/// Why the stops cannot tell the answer; empty when they can. What only the spread of the arm tells is told.
std::string open_directions(const fit::Solution& result);

/// The calibration while it goes on, in the stages of the pipeline. Whether a stop is sound is what calibrate_hand_eye
/// says of it with the cell as it is calibrated.
struct CellEstimation {
  using Place = HandEyeResult;

  CellInput input;
  HandEyeResult start;
  std::vector<double> weights;
  CellSigmas sigmas = {};
  std::optional<CellProblem> problem = std::nullopt;
  fit::Solution result = {};
  HandEyeResult judged = {};  ///< With the calibrated cell.
  double robot_dof = uncertainty::known_noise;
  int iterations = 0;

  std::vector<HandEyeResult> starts() const;
  fit::pipeline::Minimum<HandEyeResult> descend(const HandEyeResult& from) const { return revisit(from); }
  void begin(const HandEyeResult& from);
  void find_noise();
  std::vector<double> probabilities();
  std::size_t fewest() const { return 4; }
  double false_alarm() const { return input.options.outlier_false_alarm; }
  HandEyeResult place() const;
  fit::pipeline::Minimum<HandEyeResult> revisit(HandEyeResult from) const;
  bool same(const HandEyeResult& one, const HandEyeResult& other) const;

  CellGeometry cell() const { return problem ? problem->cell(input.believed) : input.believed; }
  std::vector<HandEyeView> views() const { return views_in(input.stops, input.believed, cell()); }

 private:
  bool update_sigmas();
};

}  // namespace kr5::calibration::cell_calibration
