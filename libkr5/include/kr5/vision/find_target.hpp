// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/target.hpp>
#include <kr5/geometry/view.hpp>
#include <kr5/vision/find_tags.hpp>
#include <kr5/vision/image.hpp>

/// @file
/// Targets in an image. Pixels are those of `Pinhole`: the centre of the first one is (0, 0).

namespace kr5::vision {

enum class DetectStatus {
  Found,        ///< `view` holds the points.
  Mirrored,     ///< The target is there, but only in the mirrored image.
  Inverted,     ///< The target is there, but black and white are exchanged.
  WrongMarker,  ///< Markers of the family, but none of the target.
  WrongFamily,  ///< Markers of another family.
  WrongSize,    ///< A board with other rows or columns, in number or shifted against each other.
  TooDark,
  Overexposed,
  Blurred,
  NotFound,  ///< Nothing like it, for no reason that can be named.
};
constexpr auto enum_names(DetectStatus) {
  return names<DetectStatus>({{DetectStatus::Found, "found"},
                              {DetectStatus::Mirrored, "mirrored"},
                              {DetectStatus::Inverted, "inverted"},
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
    visit("decimate", self.decimate,
          "Decimation of the image as in TagOptions; 0: finer ones are tried in turn while nothing is found [-].");
    visit("threads", self.threads, "Number of threads of the search [-].");
    visit("refine", self.refine, "Refinement of the points: model | none.");
    visit("explain", self.explain,
          "Search for the reason when nothing is found (takes longer than the search itself).");
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
    visit("status", self.status, "Whether the target was found, or why not.");
    visit("message", self.message, "Explanation of the status, with the remedy.");
    visit("view", self.view, "Points seen, with their coordinates on the target.");
    visit("sigma", self.sigma, "Standard deviation of each point per axis; 0 when not refined [px].");
    visit("correlation", self.correlation,
          "Correlation factor: largest `correlation` of the tags whose corners are the points; 1 for points found "
          "independently. It is an option of the estimators [-].");
    visit("tags", self.tags, "Markers of the target's family that were seen.");
  }
};

/// Looks for one target. Boards with markers may be seen in part; chessboards and dot grids must be seen whole.
/// Where a board looks the same after a turn, the answer is the one whose first point lies nearest to the upper left
/// corner of the image (x + y least); a chessboard with an odd sum of rows and columns, or a dot grid with a bigger dot
/// in one corner, has no such uncertainty. Centres of dots are those of the circles on the board, not of the ellipses
/// in the image: perspective moves the two apart. @throws InvalidArgument for an empty image, a bad target or bad
/// options.
Detection find_target(ImageView image, const Target& target, const DetectOptions& options = {});

/// Why an image shows no marker of `options.families`, as status and message: they are mirrored or inverted, of another
/// family, or the picture is too dark, overexposed or blurred. @throws InvalidArgument as find_tags.
Detection explain_no_tags(ImageView image, const TagOptions& options);

}  // namespace kr5::vision
