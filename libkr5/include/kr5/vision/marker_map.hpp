// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <kr5/core/fit_report.hpp>
#include <kr5/fit/pipeline/second_minimum.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/target.hpp>
#include <kr5/vision/find_target.hpp>

/// @file
/// Where markers sit relative to each other, from images that show several of them at once.

namespace kr5::vision {

/// The markers seen in one image.
struct MarkerSighting {
  std::string name;
  std::vector<TagDetection> tags;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "File or number of the image.");
    visit("tags", self.tags, "Markers seen in the image.");
  }
};

struct MarkerMapOptions {
  double size = 0.0;  ///< [m]
  int reference = -1;
  double sigma_pixel = 0.0;           ///< [px]
  double outlier_false_alarm = 0.01;  ///< [-]
  int max_iterations = 50;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("size", self.size, "Side of the markers' squares [m].");
    visit("reference", self.reference, "Id of the marker whose frame is that of the map; -1: the lowest id.");
    visit("sigma_pixel", self.sigma_pixel, "Standard deviation of a corner per axis; 0: estimated from the data [px].");
    visit("outlier_false_alarm", self.outlier_false_alarm,
          "Probability of a false outlier in sound data, over all images [-].");
    visit("max_iterations", self.max_iterations, "Maximum number of steps of the refinement.");
  }
};

struct MarkerMapResult {
  Target target;                          ///< The map; its frame is that of the reference marker.
  std::vector<Matrix6> covariance;        ///< Of each T_target_marker, in the order of `target.map` [m, rad].
  std::vector<std::vector<int>> islands;  ///< Ids that images connect; one list when all is well.
  std::vector<std::string> views;
  std::vector<Pose> T_target_camera;  ///< In the order of `views`.
  std::vector<double> view_rms_px;    ///< [px]
  std::vector<bool> view_outlier;
  double rms_px = 0.0;       ///< [px]
  double sigma_pixel = 0.0;  ///< [px]
  std::optional<fit::pipeline::SecondMinimum> second;
  int second_marker = -1;
  FitReport fit;  ///< Look at `fit.usable()` first.

  static void each_field(auto& self, auto&& visit) {
    visit("target", self.target, "The map, a target of kind marker_map; its frame is that of the reference marker.");
    visit("covariance", self.covariance,
          "Covariance of each T_target_marker, right perturbation, in the order of the map [m, rad].");
    visit("islands", self.islands,
          "Groups of marker ids that images connect with each other; one group when the map is complete.");
    visit("views", self.views, "Names of the images used.");
    visit("T_target_camera", self.T_target_camera, "Pose of the camera in the map for each of them.");
    visit("view_rms_px", self.view_rms_px, "RMS distance of seen and predicted corners in each of them [px].");
    visit(
        "view_outlier", self.view_outlier,
        "Contradiction of each of them to the others by more than three times their noise; it has no part in the map.");
    visit("rms_px", self.rms_px, "RMS distance of seen and predicted corners over all images that have a part [px].");
    visit("sigma_pixel", self.sigma_pixel, "Standard deviation of a corner per axis, given or estimated [px].");
    visit(
        "second", self.second,
        "Another pose of the marker `second_marker` with nearly the same cost; where the two cannot be told apart, the "
        "fit is not usable.");
    visit("second_marker", self.second_marker, "Id of the marker that turns most in the second minimum; -1: none.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Map of all markers of one family by joint adjustment of marker and camera poses on the pixels. Markers that no chain
/// of images connects to the reference make the status Degenerate, with the islands named; so do images without two
/// markers, and two maps that explain the images alike, as of distant markers seen from the front; a second map that is
/// near, too, where the rotation of a marker is known to no better than 0.05 rad. Images that contradict the others
/// have no part. Of markers with equal ids in one image none is used there.
/// @throws InvalidArgument for a bad camera or option, a reference that is nowhere seen, markers of two families.
MarkerMapResult estimate_marker_map(std::span<const MarkerSighting> images, const Pinhole& camera,
                                    const MarkerMapOptions& options);

}  // namespace kr5::vision
