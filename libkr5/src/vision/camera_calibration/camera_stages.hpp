// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include <kr5/fit/pipeline/pipeline.hpp>
#include <kr5/fit/pipeline/second_minimum.hpp>
#include <kr5/vision/camera_calibration.hpp>

#include "vision/camera_calibration/camera_start.hpp"
#include "vision/camera_calibration/robust_adjustment.hpp"

namespace kr5::vision::detail {

/// The richest model that all allowed ones of moderate size belong to: views are judged under it.
CameraModel reference_model(const CameraOptions& options);

/// Another focal length that explains the views nearly as well.
struct SecondCamera {
  double fx = 0.0;                       ///< [px]
  fit::pipeline::SecondMinimum minimum;  ///< Of the pose of the target in the view in which it moves most.
};

/// Camera calibration in the stages of the pipeline, under the reference model; a measurement is a view.
class CameraStages {
 public:
  using Place = CameraState;

  CameraStages(const CameraProblem& problem, const CameraOptions& options, CameraStart start,
               std::vector<CameraViewReport>& reports);

  std::vector<CameraState> starts();
  fit::pipeline::Minimum<CameraState> descend(const CameraState& from) const;
  void begin(const CameraState& from);
  void find_noise();
  std::vector<double> probabilities();
  std::size_t fewest() const { return std::max<std::size_t>(3, weights.size() / 2); }
  double false_alarm() const { return options_.false_alarm; }
  CameraState place() const { return fit->adjustment.state(); }
  fit::pipeline::Minimum<CameraState> revisit(const CameraState& from) const;
  bool same(const CameraState& one, const CameraState& other) const;

  /// Whether any view is explained by a pose.
  bool any() const;
  /// Views that contradict the others are told; unless they are to be rejected, they take part in the fit.
  void name_outliers();
  std::vector<bool> used() const;
  /// Empty where the rival is too much worse, or another pose of a target under the same camera. `best`: the place
  /// where the pipeline ended, of the same model; `dispersion`: of the views, by which the costs are too great.
  std::optional<SecondCamera> second(const CameraState& best, const fit::pipeline::Rival<CameraState>& rival,
                                     double dispersion) const;

  std::vector<double> weights;  ///< Of views.
  std::optional<RobustAdjustment> fit;
  double initial_rms = 0.0;  ///< [px]
  int rough_iterations = 0;

 private:
  RobustAdjustment rough(const CameraState& from) const;
  void exclude(std::size_t view, const std::string& why);
  void exclude_mirrored_views(const CameraState& state);

  const CameraProblem& problem_;
  const CameraOptions& options_;
  CameraStart start_;
  std::vector<CameraViewReport>& reports_;
  std::vector<bool> usable_;  ///< Views that are neither in the wrong order nor mirrored.
  bool settled_ = false;      ///< Whether the fit is one of the reference model.
};

}  // namespace kr5::vision::detail
