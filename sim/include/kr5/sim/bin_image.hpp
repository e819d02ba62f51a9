// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/sim/pellet_bin.hpp>

namespace kr5::sim {

/// Light and surfaces of a picture of black pellets in a dark steel bin: Lambert's law, and a gloss lobe that is far
/// brighter than it (Hayat et al. 2022, section 2.4).
struct BinImageOptions {
  double pellet_albedo = 0.05;                 ///< [-]
  double bin_albedo = 0.07;                    ///< [-]
  double gloss = 0.25;                         ///< [-]
  double shininess = 80.0;                     ///< [-]
  double ambient = 0.3;                        ///< [-]
  double gain = 3.0;                           ///< [-]
  Eigen::Vector3d light = {0.08, -0.05, 0.0};  ///< [m]
  double noise = 1.5;                          ///< [grey]
  double blur = 0.7;                           ///< [px]
  int seed = 1;

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("pellet_albedo", self.pellet_albedo, "Share of the light that a pellet scatters [-].");
    visit("bin_albedo", self.bin_albedo, "Share of the light that the bin scatters [-].");
    visit("gloss", self.gloss, "Share of the light that goes into the gloss lobe [-].");
    visit("shininess", self.shininess, "Exponent of the gloss lobe: the greater, the smaller a shiny spot [-].");
    visit("ambient", self.ambient, "Light from all sides, over that of the lamp [-].");
    visit("gain", self.gain, "Grey level of a white surface that faces the lamp, over 255 [-].");
    visit("light", self.light, "Place of the lamp in the frame of the camera [m].");
    visit("noise", self.noise, "Standard deviation of the noise of a pixel [grey].");
    visit("blur", self.blur, "Standard deviation of the blur [px].");
    visit("seed", self.seed, "Random seed of the noise.");
  }
};

/// A picture, and what each pixel shows.
struct BinImage {
  Eigen::Matrix<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> grey;  ///< height x width [grey]
  Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> surface;        ///< Pellet, or a BinSurface.
};

/// A camera above the middle of a bin, looking straight down, its X along that of the bin.
/// @param height Above the floor [m].
Pose camera_above(const BinShape& bin, double height);

/// Picture of a bin by one lamp, with shadows; a ray through the middle of each pixel.
/// @throws InvalidArgument naming the field of scene, camera or options.
BinImage render_bin(const PelletScene& scene, const Pinhole& camera, const Pose& T_base_camera,
                    const BinImageOptions& options = {});

}  // namespace kr5::sim
