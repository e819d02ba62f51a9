// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>

#include <Eigen/Core>

#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/placed.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/geometry/target.hpp>
#include <kr5/geometry/view.hpp>
#include <kr5/vision/image.hpp>

/// @file
/// Pictures of targets and simple solids with known truth. The value of a pixel is the area average of what its square
/// sees through the lens model, so that edges agree with `Pinhole::project` to a few thousandths of a pixel.

namespace kr5::vision {

using kr5::PlacedSolid;
using kr5::PlacedTarget;

struct RenderOptions {
  int oversampling = 16;  ///< [-]
  double margin = 0.5;    ///< [-]
  double dot = 0.5;       ///< [-]
  int big_dot = -1;
  double big_dot_factor = 1.5;  ///< [-]
  double black = 30.0;          ///< [grey]
  double white = 220.0;         ///< [grey]
  double background = 110.0;    ///< [grey]
  double clutter = 0.0;         ///< [grey]
  double brightness = 1.0;      ///< [-]
  double gradient_x = 0.0;      ///< [-]
  double gradient_y = 0.0;      ///< [-]
  double vignetting = 0.0;      ///< [-]
  double blur = 0.0;            ///< [px]
  double noise = 0.0;           ///< [grey]
  int seed = 1;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("oversampling", self.oversampling, "Samples across and down a pixel that an edge crosses [-].");
    visit("margin", self.margin, "White border around the target, in units of its size [-].");
    visit("dot", self.dot, "Diameter of a circle grid's dots over their distance [-].");
    visit("big_dot", self.big_dot,
          "Number of a dot that is drawn larger to mark the orientation of the grid; -1: none.");
    visit("big_dot_factor", self.big_dot_factor, "Ratio of its diameter to that of the others [-].");
    visit("black", self.black, "Grey of the ink [grey, 0 to 255].");
    visit("white", self.white, "Grey of the paper [grey, 0 to 255].");
    visit("background", self.background, "Grey of the background [grey, 0 to 255].");
    visit("clutter", self.clutter, "Standard deviation of a smooth random pattern on the background [grey].");
    visit("brightness", self.brightness, "Factor on every grey [-].");
    visit("gradient_x", self.gradient_x, "Relative change of the light from the middle to the right edge [-].");
    visit("gradient_y", self.gradient_y, "Relative change of the light from the middle to the lower edge [-].");
    visit("vignetting", self.vignetting, "Relative loss of light in the corners of the image [-].");
    visit("blur", self.blur, "Standard deviation of the lens blur, in addition to the area of a pixel [px].");
    visit("noise", self.noise, "Standard deviation of the camera noise, before rounding to whole greys [grey].");
    visit("seed", self.seed, "Random seed of noise and clutter; the same seed gives the same image.");
  }
};

/// What the camera sees of the targets. Nearer ones hide farther ones; the back of a marker is plain paper.
/// @throws InvalidArgument for a bad camera, target or option, and for a marker number its family does not have.
Image render(std::span<const PlacedTarget> targets, const Pinhole& camera, const RenderOptions& options = {});

/// The same with balls, tubes (and their bores) and plates, which hide and are hidden, lit from the upper left behind
/// the camera. The name of a wrong field is that of the solid.
Image render(std::span<const PlacedTarget> targets, std::span<const PlacedSolid> solids, const Pinhole& camera,
             const RenderOptions& options = {});

/// The truth of such an image: every point of the target that faces the camera and lies inside the image, where it is
/// seen. What another target hides is not left out.
View visible_points(const Target& target, const Pose& T_camera_target, const Pinhole& camera);

/// Printed area of a planar target with its margin: lowest x, y in column 0, highest in column 1 [m].
/// @throws InvalidArgument for a marker map, which has no plane.
Eigen::Matrix2d printed_area(const Target& target, const RenderOptions& options = {});

/// The target to scale, as for a printer: `pixels_per_metre` dots along a metre, first pixel at the first corner of
/// `printed_area`. Light, blur and noise are left out.
Image draw_target(const Target& target, double pixels_per_metre, const RenderOptions& options = {});

}  // namespace kr5::vision
