// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Camera projection matrices from points, points of a plane from pixels, and how uncertain these are for the noise of
/// the pixels the matrix was estimated from (Hayat et al. 2022, section 3.4.2).

namespace kr5 {

/// lambda [u v 1]^T = M [p 1]^T; rows of the scale at which lambda is the depth [px, m].
using ProjectionMatrix = Eigen::Matrix<double, 3, 4>;

/// The points p with normal . p = distance.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double distance = 0.0;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("normal", self.normal, "Unit normal.");
    visit("distance", self.distance, "Distance from the origin along the normal [m].");
  }
};

/// Of a camera without its lens distortion.
ProjectionMatrix projection_matrix(const Pinhole& camera, const Pose& T_camera_grid);

/// Linear least squares (DLT) from points [m] and their pixels, in coordinates normalised after Hartley.
/// @throws InvalidArgument for fewer than six points, unequal numbers, NaN, or points in one plane.
ProjectionMatrix estimate_projection_matrix(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels);

/// The point of the plane that is seen at a pixel [m].
/// @throws InvalidArgument where the plane is seen edge on.
Eigen::Vector3d back_project(const ProjectionMatrix& M, const Eigen::Vector2d& pixel, const Plane& plane);

struct BackProjectionOptions {
  double sigma_pixel = 0.5;  ///< [px]
  bool noisy_pixel = false;
  double length_unit = 1e-3;  ///< [m]
  int draws = 4000;
  std::uint64_t seed = 1;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("sigma_pixel", self.sigma_pixel, "Standard deviation of u and v of a corner [px].");
    visit("noisy_pixel", self.noisy_pixel,
          "Whether the pixel that is projected back carries its noise; the book takes the true one.");
    visit("length_unit", self.length_unit,
          "Unit of length of eq. 3.56, which gives another result in each; the book has mm [m].");
    visit("draws", self.draws, "Draws of the simulation; 0: none.");
    visit("seed", self.seed, "Random seed.");
  }
};

/// One corner projected back.
struct BackProjectedCorner {
  int index = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();           ///< [m]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();      ///< [m^2]
  Eigen::Matrix3d simulated = Eigen::Matrix3d::Zero();       ///< [m^2]
  Eigen::Vector3d simulated_mean = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Matrix3d approximate = Eigen::Matrix3d::Zero();     ///< [m^2]

  static void each_field(auto& self, auto&& visit) {
    visit("index", self.index, "Number of the corner among the points.");
    visit("point", self.point, "Its place [m].");
    visit("covariance", self.covariance, "Covariance of its back-projection, to first order, exact Jacobian [m^2].");
    visit("simulated", self.simulated, "Covariance in the simulation [m^2].");
    visit("simulated_mean", self.simulated_mean, "Mean error in the simulation [m].");
    visit("approximate", self.approximate, "Covariance by the approximate formula of eq. 3.56 [m^2].");
  }
};

struct BackProjectionResult {
  ProjectionMatrix M = ProjectionMatrix::Zero();
  double sigma_matrix = 0.0;
  std::vector<BackProjectedCorner> corners;

  static void each_field(auto& self, auto&& visit) {
    visit("M", self.M, "Projection matrix [px, m].");
    visit("sigma_matrix", self.sigma_matrix,
          "RMS standard deviation of its entries in the unit of eq. 3.56, which takes all of them as alike.");
    visit("corners", self.corners, "Corners on the plane.");
  }
};

/// What pixel noise does to corners on a plane that are projected back by a matrix estimated from noisy corners: by the
/// exact Jacobian of estimate and back-projection, by simulation, and by eq. 3.56, s_M^2 (x^T x) (M^T M)^+, which
/// neglects the scale lambda and takes the entries of M as equally uncertain and independent.
/// @throws InvalidArgument as estimate_projection_matrix, or when no point lies on the plane.
BackProjectionResult back_projection_uncertainty(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels,
                                                 const Plane& plane, const BackProjectionOptions& options = {});

}  // namespace kr5
