// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/image_view.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/uncertain_pose.hpp>
#include <kr5/picking/pellets.hpp>

/// @file
/// Pose of a cylinder from an image, when the cloud alone is not enough: aligned or partly hidden ones (Hayat et al.
/// 2022, sections 2.3.3 and 3.4.4). Only edges that the estimate from the cloud predicts are searched, within its
/// uncertainty; the estimate enters the fit with its covariance, so that the result is what cloud and image say
/// together.

namespace kr5::picking {

struct PelletImageOptions {
  double edge_spacing = 4.0;
  double search_sigmas = 3.0;
  double max_search = 30.0;
  double min_edge = 4.0;
  double edge_sigma = 0.15;
  double edge_bias = 0.5;
  double min_supported = 0.5;
  double clearly_better = 0.75;
  double confidence = 0.999;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("edge_spacing", self.edge_spacing, "Distance of the places along the outline where edges are searched [px].");
    visit("search_sigmas", self.search_sigmas,
          "Half width of the search, in standard deviations of the prediction [-].");
    visit("max_search", self.max_search, "Maximum half width of the search [px].");
    visit("min_edge", self.min_edge, "Minimum slope of an edge, in standard deviations of the noise of a slope [-].");
    visit("edge_sigma", self.edge_sigma,
          "Standard deviation of a single edge beside what the noise of the image makes: unevenness, shading [px].");
    visit("edge_bias", self.edge_bias,
          "Standard deviation of the displacement that all edges of one line or arc share: shading, chamfers, focus "
          "[px].");
    visit("min_supported", self.min_supported,
          "Minimum share of the predicted edges that must be found, of all and of those of the ends [-].");
    visit("clearly_better", self.clearly_better,
          "Support of the second best place, relative to the best, from which on the two are indistinguishable [-].");
    visit("confidence", self.confidence,
          "Probability that a right result passes the check of image against cloud [-].");
  }
};

enum class PelletImageStatus {
  Refined,
  OutsideImage,   ///< Most of the outline lies outside the image or is hidden.
  TooFewEdges,    ///< The edges that should be there are not.
  Ambiguous,      ///< Two places are supported nearly alike.
  Contradiction,  ///< The image says something the cloud rules out.
};
constexpr auto enum_names(PelletImageStatus) {
  return names<PelletImageStatus>({{PelletImageStatus::Refined, "refined"},
                                   {PelletImageStatus::OutsideImage, "outside_image"},
                                   {PelletImageStatus::TooFewEdges, "too_few_edges"},
                                   {PelletImageStatus::Ambiguous, "ambiguous"},
                                   {PelletImageStatus::Contradiction, "contradiction"}});
}

struct PelletRefinement {
  PelletImageStatus status = PelletImageStatus::OutsideImage;
  Pellet pellet;
  int predicted = 0;
  int supported = 0;
  double noise = 0.0;
  double rms_px = 0.0;
  double second_best = 0.0;
  FitReport fit;

  bool refined() const { return status == PelletImageStatus::Refined; }

  static void each_field(auto& self, auto&& visit) {
    visit("status", self.status, "Whether the pose was refined, or why not.");
    visit("pellet", self.pellet, "The cylinder, refined, with covariance; as it was given when it was not refined.");
    visit("predicted", self.predicted, "Number of places at which an edge was expected.");
    visit("supported", self.supported, "Number of those at which one was found.");
    visit("noise", self.noise, "Standard deviation of the noise of the image [grey].");
    visit("rms_px", self.rms_px, "RMS distance of the edges from the outline [px].");
    visit("second_best", self.second_best,
          "Support of the second best place, relative to the best, where the two differ [-].");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Refines the pose, radius and height of a cylinder. The outline of a finite cylinder in perspective is exact: both
/// lines where the line of sight touches the side, the rim of an end that is seen, the near half of the other. At
/// places along it edges are searched along the normal, of either sign, as strong as the contrast about them lets them
/// be (an edge counts by its slope over the local contrast, no more than once, so that a bright streak outweighs
/// nothing). The place that most edges support, within the uncertainty of the prediction, starts a robust fit of pose,
/// sizes, pose of the camera and a displacement of each line and arc.
/// @param T_camera_base Pose of the base in the camera of this image, with covariance.
/// @param others Cylinders that may hide part of this one, as from find_pellets; itself among them does not matter.
/// Where the outline of one runs along its own, no edge is expected.
/// @throws InvalidArgument for an image that is not of the size of the camera's, an invalid camera, pose, cylinder or
/// covariance, or invalid options.
PelletRefinement refine_pellet(ImageView image, const Pinhole& camera, const UncertainPose& T_camera_base,
                               const Pellet& pellet, const std::vector<Pellet>& others = {},
                               const PelletImageOptions& options = {});

}  // namespace kr5::picking
