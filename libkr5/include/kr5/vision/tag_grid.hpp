// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include <kr5/core/fit_report.hpp>
#include <kr5/vision/find_tags.hpp>

/// @file
/// The board of tags that images show, when nobody says which it is.

namespace kr5::vision {

struct TagGridOptions {
  double tolerance = 0.25;  ///< [-]
  int min_tags = 6;         ///< [-]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("tolerance", self.tolerance,
          "Distance of a tag from its place in the grid, over the spacing of the tags, up to which it stands there; "
          "lenses bend the grid [-].");
    visit("min_tags", self.min_tags, "Number of tags in one image from which a grid is told.");
  }
};

struct TagGrid {
  std::string family;
  std::vector<int> ids;
  int rows = 0;             ///< [-]
  int cols = 0;             ///< [-]
  double gap = 0.0;         ///< [-]
  double gap_spread = 0.0;  ///< [-]
  double misfit = 0.0;      ///< [-]
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("family", self.family, "Marker family of most tags; empty when there are none.");
    visit("ids", self.ids, "Ids of its tags, ascending, without those seen less than half as often as the commonest.");
    visit("rows", self.rows, "Number of rows.");
    visit("cols", self.cols, "Number of columns.");
    visit("gap", self.gap, "Gap between two tags over the side of a tag [-].");
    visit("gap_spread", self.gap_spread, "Robust standard deviation of the gaps of single pairs of neighbours [-].");
    visit("misfit", self.misfit, "Largest distance of a tag from its place, over the spacing of the tags [-].");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Rows, columns and gap of a board whose tags are numbered row by row from 0, from the tags in each of some images of
/// it; their size cannot be told. Of all numbers of columns the right one is that under which the first corners of the
/// tags and a lattice differ by a homography, in the image with most tags; the gap is a cross-ratio of the corners of
/// neighbours, which neither slant nor, so near, the lens changes. Tags with equal ids in one image are not used there.
///
/// `fit.usable()` is false for one tag, for too few, for tags on one line, and for tags that stand otherwise.
/// @throws InvalidArgument for an invalid option, a negative id, or corners that are not finite.
TagGrid guess_tag_grid(std::span<const std::vector<TagDetection>> images, const TagGridOptions& options = {});

}  // namespace kr5::vision
