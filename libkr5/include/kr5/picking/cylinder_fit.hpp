// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/core/fit_report.hpp>

/// @file
/// Cylinder of least squared distances to points of its side (Hayat et al. 2022, eqs 2.9 to 2.11).

namespace kr5::picking {

struct CylinderFitOptions {
  double radius = 0.0;
  double sigma_radius = 0.0;
  double noise = 0.0;
  double outlier_limit = 4.5;
  int max_rounds = 40;
  double accepted_std = 0.2;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("radius", self.radius, "Radius known beforehand; 0: not known [m].");
    visit("sigma_radius", self.sigma_radius,
          "Standard deviation of the radius known beforehand; 0: the radius is exactly that [m].");
    visit("noise", self.noise, "Standard deviation of a point; 0: from the residuals [m].");
    visit("outlier_limit", self.outlier_limit,
          "Residual beyond which a point is left out, in standard deviations [-].");
    visit("max_rounds", self.max_rounds, "Maximum number of fits, each without the outliers of the one before.");
    visit("accepted_std", self.accepted_std,
          "Standard deviation of a radius that is not known, relative to it, above which points are refused [-].");
  }
};

struct CylinderFit {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  double radius = 0.0;
  Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 3, 2> across = Eigen::Matrix<double, 3, 2>::Zero();
  double arc = 0.0;
  double length = 0.0;
  double noise = 0.0;
  int points = 0;
  int outliers = 0;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("point", self.point, "Point of the axis in the middle of the points [m].");
    visit("axis", self.axis, "Direction of the axis, of length 1; its sign means nothing.");
    visit("radius", self.radius, "Radius [m].");
    visit("covariance", self.covariance,
          "Covariance of the point along both columns of `across` [m], of the rotation about both [rad], and "
          "of "
          "the radius [m].");
    visit("across", self.across, "Two directions square to the axis and to each other, as columns.");
    visit("arc", self.arc, "Angle about the axis that the points cover [rad].");
    visit("length", self.length, "Length along the axis that the points cover [m].");
    visit("noise", self.noise, "Standard deviation of the distances to the surface [m].");
    visit("points", self.points, "Number of points used.");
    visit("outliers", self.outliers, "Number of points left out.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Fits a cylinder without ends to points, 3 x n [m]. Without an axis the best of directions all over the sphere is
/// where it starts, then the squared distances to the surface are made least. Noise across a curved surface makes
/// points lie outside it on average, by sigma^2 / 2 r; that bias is taken out. Points that contradict the others are
/// left out. `fit.usable()` is false for too few points, for points that lie in a plane or cover too short an arc for a
/// radius that is not known, and when the points are no cylinder. @throws InvalidArgument for invalid options, or
/// points that are not finite.
CylinderFit fit_cylinder(const Eigen::Matrix3Xd& points, const CylinderFitOptions& options = {},
                         const std::optional<Eigen::Vector3d>& axis = std::nullopt);

}  // namespace kr5::picking
