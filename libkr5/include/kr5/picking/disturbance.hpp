// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/image_view.hpp>

/// @file
/// What changed between two images from one pose of the camera (Hayat et al. 2022, section 2.4.1). Images are averaged
/// over small squares first: that lowers the noise, so that a change of low contrast shows, and noise that neighbouring
/// pixels share is learnt with it.

namespace kr5::picking {

using PixelMask = Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic>;  ///< Rows by columns of an image.

struct ImageNoiseOptions {
  int average = 1;
  double min_spread = 0.3;
  double moved_share = 0.001;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("average", self.average,
          "Half side of the square over which an image is averaged: 1 is 3 x 3 pixels, 0 none [px].");
    visit("min_spread", self.min_spread,
          "Minimum standard deviation of an averaged pixel; the rounding of a grey level has 0.29 [grey].");
    visit("moved_share", self.moved_share,
          "Share of the pixels that may lie far off before an image counts as one in which something moved [-].");
  }
};

/// How the image of a scene at rest scatters.
struct ImageNoise {
  Eigen::MatrixXd mean;
  Eigen::MatrixXd spread;
  double dof = 0.0;
  int average = 0;
  int images = 0;
  int left_out = 0;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("mean", self.mean, "Median of each averaged pixel [grey].");
    visit("spread", self.spread, "Standard deviation of each averaged pixel in one image [grey].");
    visit("dof", self.dof, "Degrees of freedom of the standard deviations [-].");
    visit("average", self.average, "Half side of the square over which images are averaged [px].");
    visit("images", self.images, "Number of images used.");
    visit("left_out", self.left_out, "Number of images left out, for something moved in them.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Learns the noise of each pixel from repeated images of a scene at rest; the arm should leave the pose and return
/// between them, as it will between picks, for then its repeatability is learnt, too. Light that flickers is taken out,
/// images in which something moved are left out. The variances of single pixels, known from few images only, are drawn
/// towards the one they share as far as they scatter no more than chance makes them (moderated variances, Smyth 2004).
/// `fit.usable()` is false for fewer than three images at rest. @throws InvalidArgument for images of different size,
/// or invalid options.
ImageNoise learn_image_noise(std::span<const ImageView> images, const ImageNoiseOptions& options = {});

struct ChangeOptions {
  double false_alarms = 0.01;
  int min_region = 16;
  double max_light_change = 0.3;
  double max_saturated = 0.1;
  double max_moved_tiles = 0.6;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("false_alarms", self.false_alarms,
          "Number of pixels of a scene at rest that may be taken for changed, per image, in the mean [-].");
    visit("min_region", self.min_region, "Minimum size of a connected region that counts as a change [px].");
    visit("max_light_change", self.max_light_change,
          "Maximum change of the light between the images, relative, that is taken out [-].");
    visit("max_saturated", self.max_saturated,
          "Maximum share of pixels at the end of the grey scale, which show no change [-].");
    visit("max_moved_tiles", self.max_moved_tiles,
          "Share of the parts of the image with structure above which all has changed: the camera has moved [-].");
  }
};

enum class ChangeFinding {
  Unchanged,     ///< Nothing moved.
  Changed,       ///< Something moved, in the regions listed.
  CameraMoved,   ///< All changed: the camera, the bin, or something before the lens.
  LightChanged,  ///< The light changed by too much.
  Saturated,     ///< Too much of an image is black or white.
};
constexpr auto enum_names(ChangeFinding) {
  return names<ChangeFinding>({{ChangeFinding::Unchanged, "unchanged"},
                               {ChangeFinding::Changed, "changed"},
                               {ChangeFinding::CameraMoved, "camera_moved"},
                               {ChangeFinding::LightChanged, "light_changed"},
                               {ChangeFinding::Saturated, "saturated"}});
}

/// A connected region of changed pixels.
struct ChangeRegion {
  int pixels = 0;
  int left = 0, top = 0, right = 0, bottom = 0;  ///< [px]
  double mean_change = 0.0;                      ///< [grey]

  static void each_field(auto& self, auto&& visit) {
    visit("pixels", self.pixels, "Number of pixels.");
    visit("left", self.left, "First column [px].");
    visit("top", self.top, "First row [px].");
    visit("right", self.right, "Last column [px].");
    visit("bottom", self.bottom, "Last row [px].");
    visit("mean_change", self.mean_change, "Mean of the absolute changes [grey].");
  }
};

struct ImageChange {
  ChangeFinding finding = ChangeFinding::Saturated;
  std::string message = "not run";
  PixelMask changed;
  std::vector<ChangeRegion> regions;
  double threshold = 0.0;
  double gain = 1.0;
  double offset = 0.0;

  /// Whether the mask may be used; if not, scan again.
  bool usable() const { return finding == ChangeFinding::Unchanged || finding == ChangeFinding::Changed; }

  static void each_field(auto& self, auto&& visit) {
    visit("finding", self.finding, "Whether something moved, or why that cannot be said.");
    visit("message", self.message, "Explanation, with the remedy.");
    visit("changed", self.changed, "Whether a pixel changed, of the shape of the image.");
    visit("regions", self.regions, "Connected regions that changed, largest first.");
    visit("threshold", self.threshold, "Change that counts, in standard deviations of a difference [-].");
    visit("gain", self.gain, "Factor of the light from the first image to the second [-].");
    visit("offset", self.offset, "Grey level added to it [grey].");
  }
};

/// What changed from one image to another, both from the pose of the camera at which the noise was learnt. The change
/// of the light, a line through most pixels, is taken out; then a pixel has changed when it differs by more than
/// chance lets any pixel of the image, and stands in a region that is large enough.
/// @throws InvalidArgument for images of another size than the noise, noise that is not usable, or invalid options.
ImageChange find_changes(ImageView before, ImageView after, const ImageNoise& noise, const ChangeOptions& options = {});

}  // namespace kr5::picking
