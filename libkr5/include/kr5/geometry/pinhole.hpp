// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>

namespace kr5 {

/// Which coefficients of a Pinhole a lens has; the others are 0. Fewest first.
enum class LensModel {
  None,       ///< No distortion.
  K1,         ///< k1.
  K1K2,       ///< k1 k2.
  Brown4,     ///< k1 k2 p1 p2.
  Brown5,     ///< k1 k2 p1 p2 k3: OpenCV's default.
  Radial6,    ///< k1 to k6: rational, without tangential terms.
  Rational8,  ///< k1 to k6, p1 p2: the book's.
};

constexpr auto enum_names(LensModel) {
  return names<LensModel>({{LensModel::None, "none"},
                           {LensModel::K1, "k1"},
                           {LensModel::K1K2, "k1k2"},
                           {LensModel::Brown4, "brown4"},
                           {LensModel::Brown5, "brown5"},
                           {LensModel::Radial6, "radial6"},
                           {LensModel::Rational8, "rational8"}});
}

/// Pinhole camera with the rational lens model of Hayat et al. 2022, eq. A.2b (the same as OpenCV's):
/// with rho = x^2 + y^2 on the plane z = 1,
///   g = (1 + k1 rho + k2 rho^2 + k3 rho^3) / (1 + k4 rho + k5 rho^2 + k6 rho^3)
///   u = fx (x g + 2 p1 x y + p2 (rho + 2 x^2)) + cx,  v = fy (y g + p1 (rho + 2 y^2) + 2 p2 x y) + cy.
/// The centre of the first pixel is (0, 0); z points out of the lens, x right, y down.
struct Pinhole {
  int width = 0;                                                                          ///< [px]
  int height = 0;                                                                         ///< [px]
  double fx = 1.0, fy = 1.0, cx = 0.0, cy = 0.0;                                          ///< [px]
  double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0, k3 = 0.0, k4 = 0.0, k5 = 0.0, k6 = 0.0;  ///< [-]

  /// Order of the parameters in vectors and covariances.
  static constexpr int parameter_count = 12;
  static constexpr std::array<const char*, parameter_count> parameter_names = {"fx", "fy", "cx", "cy", "k1", "k2",
                                                                               "p1", "p2", "k3", "k4", "k5", "k6"};
  using Parameters = Eigen::Matrix<double, parameter_count, 1>;  ///< fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6
  Parameters parameters() const;
  void set_parameters(const Parameters& p);

  /// Whether the lens model holds for a point in the camera frame: in front, less than 78 degrees off the axis, and
  /// before the pole of the rational factor.
  bool covers(const Eigen::Vector3d& point) const;
  /// Pixel of a point in the camera frame [m]; the point must lie in front (z > 0).
  Eigen::Vector2d project(const Eigen::Vector3d& point) const;
  /// The same with its derivatives by the point [px/m] and by the parameters [px per unit].
  Eigen::Vector2d project(const Eigen::Vector3d& point, Eigen::Matrix<double, 2, 3>* by_point,
                          Eigen::Matrix<double, 2, parameter_count>* by_parameters) const;
  /// Direction of a pixel, scaled to z = 1; empty where the lens model cannot be inverted.
  std::optional<Eigen::Vector3d> ray(const Eigen::Vector2d& pixel) const;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    each_intrinsic(self, visit);
    visit("k1", self.k1, "Radial distortion, numerator, rho [-].");
    visit("k2", self.k2, "Radial distortion, numerator, rho^2 [-].");
    visit("p1", self.p1, "Tangential distortion [-].");
    visit("p2", self.p2, "Tangential distortion [-].");
    visit("k3", self.k3, "Radial distortion, numerator, rho^3 [-].");
    visit("k4", self.k4, "Radial distortion, denominator, rho [-].");
    visit("k5", self.k5, "Radial distortion, denominator, rho^2 [-].");
    visit("k6", self.k6, "Radial distortion, denominator, rho^3 [-].");
  }
  /// Fields of every camera, independent of its lens; for structs with the same members.
  static void each_intrinsic(auto& self, auto&& visit) {
    visit("width", self.width, "Image width [px].");
    visit("height", self.height, "Image height [px].");
    visit("fx", self.fx, "Focal length along x [px].");
    visit("fy", self.fy, "Focal length along y [px].");
    visit("cx", self.cx, "Principal point, x [px].");
    visit("cy", self.cy, "Principal point, y [px].");
  }
};

/// Places in Pinhole::parameters that a lens model frees, in the order of a list of its coefficients.
std::vector<int> lens_parameters(LensModel lens);

}  // namespace kr5
