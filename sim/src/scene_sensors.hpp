// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include <kr5/sim/driven_arm.hpp>
#include <kr5/sim/scene.hpp>

namespace kr5::sim {

/// Camera and scanner of a scene, asked once a cycle.
class SceneSensors {
 public:
  /// @param rests When pictures are taken if the scene does not say [s].
  /// @throws InvalidArgument naming the field.
  SceneSensors(const Scene& scene, const cell::Cell& cell, const std::vector<double>& rests);

  /// The cell carries other effects from now on.
  void set_cell(const cell::Cell& cell);
  void sample(double t, DrivenArm& arm);
  /// Least range of the last profile; NaN: no profile, or nothing within range [m].
  double range() const { return range_; }
  /// Pictures and profiles. @throws InvalidArgument when the scanner never met anything within its range.
  void report(SceneResult& out) const;

 private:
  void take_picture(double t, DrivenArm& arm);
  void take_profile(double t, DrivenArm& arm);

  const Scene& scene_;
  cell::Cell cell_;
  double cycle_;  ///< [s]
  std::vector<double> at_;
  std::optional<LineScanner> scanner_;
  std::vector<ScenePicture> pictures_;
  std::vector<std::vector<double>> profiles_;
  int lines_ = 0;
  double range_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace kr5::sim
