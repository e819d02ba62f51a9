// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/vision/image.hpp>

/// @file
/// Markers in an image. Pixels are those of `Pinhole`: the centre of the first one is (0, 0).

namespace kr5::vision {

enum class Refinement {
  Model,  ///< The grey levels around each corner, edge or dot fitted by a model of how they come about.
  None,   ///< As the underlying detector gives them.
};
constexpr auto enum_names(Refinement) {
  return names<Refinement>({{Refinement::Model, "model"}, {Refinement::None, "none"}});
}

struct TagOptions {
  std::vector<std::string> families = {"36h11"};
  double decimate = 0.0;     ///< [-]
  int threads = 1;           ///< [-]
  int max_hamming = 2;       ///< [-]
  double min_margin = 20.0;  ///< [grey]
  Refinement refine = Refinement::Model;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("families", self.families, "Marker families to look for.");
    visit("decimate", self.decimate,
          "Factor by which the image is reduced for the search of squares. 0: automatic, 1 up to 1.5 Mpx and 2 above, "
          "which finds tags with sides from 22 px; for AprilTags above 3 Mpx first 4 (finds sides from 45 px), then 2 "
          "unless every tag found has sides over 60 px. A small tag among large ones may thus be missed; set 2 to find "
          "it. Codes of AprilTags are read, and all corners are refined, in the full image. For AprilTags, fractions "
          "other than 1.5 are rounded down. 0.5 enlarges the image, for ArUco markers of few pixels [-].");
    visit("threads", self.threads, "Number of threads of the search [-].");
    visit("max_hamming", self.max_hamming, "Number of wrong bits of an AprilTag that are corrected, 0 to 2 [-].");
    visit("min_margin", self.min_margin,
          "Minimum decision margin of the bits of an AprilTag; markers below it are dropped [grey].");
    visit("refine", self.refine, "Refinement of the corners: model | none.");
  }
};

/// A marker in an image.
struct TagDetection {
  std::string family;
  int id = 0;
  Eigen::Matrix<double, 2, 4> corners = Eigen::Matrix<double, 2, 4>::Zero();  ///< [px]
  Eigen::Vector4d sigma = Eigen::Vector4d::Zero();                            ///< [px]
  double correlation = 1.0;                                                   ///< [-]
  bool refined = false;
  int hamming = 0;      ///< [-]
  double margin = 0.0;  ///< [grey]

  static void each_field(auto& self, auto&& visit) {
    visit("family", self.family, "Marker family.");
    visit("id", self.id, "Id of the marker.");
    visit("corners", self.corners, "Corners, clockwise from the top left as printed, 2 x 4 [px].");
    visit("sigma", self.sigma, "Standard deviation of each corner per axis; 0 when not refined [px].");
    visit("correlation", self.correlation,
          "Correlation factor: variance of the least certain common change of all four corners, which come from one "
          "fit, over that of independent corners, at least 1 [-].");
    visit("refined", self.refined, "Whether the corners come from the model of the marker fitted to the image.");
    visit("hamming", self.hamming, "Number of corrected bits (AprilTag) [-].");
    visit("margin", self.margin, "Decision margin of the bits (AprilTag) [grey].");
  }
};

/// Every marker of the families in the image; several with the same id are all returned, larger ones first.
/// @throws InvalidArgument for an empty image or bad options.
std::vector<TagDetection> find_tags(ImageView image, const TagOptions& options = {});

}  // namespace kr5::vision
