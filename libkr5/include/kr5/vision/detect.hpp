// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/target.hpp>
#include <kr5/geometry/view.hpp>
#include <kr5/vision/image.hpp>

/// @file
/// Finds markers and targets in an image. Pixels are those of `Pinhole`: the centre of the first one is (0, 0).

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
    visit("families", self.families, "Families to look for.");
    visit(
        "decimate", self.decimate,
        "Squares are searched for in the image shrunk by this. 0: 1 up to 1.5 Mpx, 2 above, which finds tags from 22 "
        "px "
        "a side; AprilTags above 3 Mpx first by 4 (all with sides of 45 px), then by 2 unless every tag found has "
        "sides "
        "over 60 px. A small tag beside large ones only may so be missed: give 2 for it. Codes of AprilTags are read, "
        "and all corners refined, in the full image. For AprilTags broken numbers but 1.5 are rounded down. 0.5 "
        "enlarges the image, for ArUco markers of few pixels [-].");
    visit("threads", self.threads, "Threads for the search [-].");
    visit("max_hamming", self.max_hamming, "Wrong bits of an AprilTag to put right, 0 to 2 [-].");
    visit("min_margin", self.min_margin, "AprilTags whose bits stand out by less are dropped [grey].");
    visit("refine", self.refine, "model | none: how corners are made exact.");
  }
};

/// One marker in an image.
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
    visit("id", self.id, "Number the marker shows.");
    visit("corners", self.corners, "Corners, clockwise from the top left as printed, 2 x 4 [px].");
    visit("sigma", self.sigma, "Standard deviation of each corner per axis; 0 when not refined [px].");
    visit(
        "correlation", self.correlation,
        "Variance of the most doubtful change of all four corners together over that of independent ones, at least 1: "
        "they come from one fit [-].");
    visit("refined", self.refined, "The model of the marker agreed with the image and gave the corners.");
    visit("hamming", self.hamming, "Bits that had to be put right (AprilTag) [-].");
    visit("margin", self.margin, "By how much the bits stand out (AprilTag) [grey].");
  }
};

/// Every marker of the families in the image; several with one number are all given, larger ones first.
/// @throws InvalidArgument for an empty image or bad options.
std::vector<TagDetection> find_tags(ImageView image, const TagOptions& options = {});

enum class DetectStatus {
  Found,        ///< `view` holds the points.
  Mirrored,     ///< The target is there, but only in the mirrored image.
  WrongMarker,  ///< Markers of the family, but none of the target.
  WrongFamily,  ///< Markers of another family.
  WrongSize,    ///< A board with another number of rows or columns.
  TooDark,
  Overexposed,
  Blurred,
  NotFound,  ///< Nothing like it, for no reason that can be named.
};
constexpr auto enum_names(DetectStatus) {
  return names<DetectStatus>({{DetectStatus::Found, "found"},
                              {DetectStatus::Mirrored, "mirrored"},
                              {DetectStatus::WrongMarker, "wrong_marker"},
                              {DetectStatus::WrongFamily, "wrong_family"},
                              {DetectStatus::WrongSize, "wrong_size"},
                              {DetectStatus::TooDark, "too_dark"},
                              {DetectStatus::Overexposed, "overexposed"},
                              {DetectStatus::Blurred, "blurred"},
                              {DetectStatus::NotFound, "not_found"}});
}

struct DetectOptions {
  double decimate = 0.0;  ///< [-]
  int threads = 1;        ///< [-]
  Refinement refine = Refinement::Model;
  bool explain = true;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("decimate", self.decimate, "As in TagOptions; 0: when nothing is found, finer ones are tried in turn [-].");
    visit("threads", self.threads, "Threads for the search [-].");
    visit("refine", self.refine, "model | none: how points are made exact.");
    visit("explain", self.explain, "When nothing is found, look for the reason (takes longer than the search).");
  }
};

/// What was seen of a target.
struct Detection {
  DetectStatus status = DetectStatus::NotFound;
  std::string message;       ///< In words, with the remedy when nothing was found.
  View view;                 ///< Points seen; ids index `target_points`. Empty unless found.
  Eigen::VectorXd sigma;     ///< [px]
  double correlation = 1.0;  ///< [-]
  std::vector<TagDetection> tags;

  bool found() const { return status == DetectStatus::Found; }

  static void each_field(auto& self, auto&& visit) {
    visit("status", self.status, "Whether the target was found, and why not.");
    visit("message", self.message, "The same in words, with the remedy.");
    visit("view", self.view, "Points seen, with their places on the target.");
    visit("sigma", self.sigma, "Standard deviation of each point per axis; 0 when not refined [px].");
    visit(
        "correlation", self.correlation,
        "Largest `correlation` of the tags whose corners the points are; 1 for points found each by itself. Give it to "
        "what estimates from them [-].");
    visit("tags", self.tags, "Markers of the target's family that were seen.");
  }
};

/// Looks for one target. Boards with markers may be seen in part; chessboards and dot grids must be seen whole.
/// Where a board looks the same after a turn, the answer is the one whose first point lies nearest to the upper left
/// corner of the image (x + y least); a chessboard with an odd sum of rows and columns, or a dot grid with a bigger dot
/// in one corner, has no such doubt. Centres of dots are those of the circles on the board, not of the ellipses in the
/// image: perspective moves the two apart. @throws InvalidArgument for an empty image, a bad target or bad options.
Detection find_target(ImageView image, const Target& target, const DetectOptions& options = {});

}  // namespace kr5::vision
