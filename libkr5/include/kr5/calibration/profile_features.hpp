// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/core/fit_report.hpp>

/// @file
/// What a profile of a line scanner shows: a pointed tip above a surface, the arc of a sphere, the line of a plane
/// (Hayat et al. 2022, sections 2.2.3 and 2.2.4).

namespace kr5::calibration {

/// What a scanner looks at when it is calibrated.
enum class ScanTargetKind {
  Tip,     ///< Pointed tip, nearer to the scanner than what is around it.
  Sphere,  ///< Ball.
  Plane,   ///< Flat surface.
};

constexpr auto enum_names(ScanTargetKind) {
  return names<ScanTargetKind>(
      {{ScanTargetKind::Tip, "tip"}, {ScanTargetKind::Sphere, "sphere"}, {ScanTargetKind::Plane, "plane"}});
}

/// Points of one line, in the X-Z plane of the scanner; NaN where nothing was measured.
struct LineProfile {
  Eigen::VectorXd x;  ///< [m]
  Eigen::VectorXd z;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("x", self.x, "Place of each point along the line; NaN where nothing was measured [m].");
    visit("z", self.z, "Range of each point; NaN where nothing was measured [m].");
  }
};

struct ProfileFeatureOptions {
  double radius = 0.0;            ///< [m]
  double radius_tolerance = 0.1;  ///< [-]
  double sigma = 0.0;             ///< [m]
  int min_points = 8;
  double max_share_off = 0.5;  ///< [-]

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("radius", self.radius, "Radius of the sphere [m]; 0: unknown.");
    visit("radius_tolerance", self.radius_tolerance,
          "Share by which the radius of an arc may exceed that of the sphere [-].");
    visit("sigma", self.sigma, "Noise of a range [m]; 0: estimated from neighbouring points.");
    visit("min_points", self.min_points,
          "Minimum number of points on an arc or a line, and on the surface about a tip.");
    visit("max_share_off", self.max_share_off,
          "Largest share of the points between the ends of an arc or line that may lie off it [-].");
  }
};

/// A feature with its covariance.
struct ProfileFeature {
  ScanTargetKind kind = ScanTargetKind::Tip;
  Eigen::Matrix2Xd points;     ///< [m]
  double radius = 0.0;         ///< [m]
  Eigen::MatrixXd covariance;  ///< [m^2]
  double sigma = 0.0;          ///< [m]
  std::vector<int> used;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "Kind: tip | sphere | plane.");
    visit("points", self.points,
          "x and z of the tip, of the centre of the arc, or of two points on the line, 2 x n [m].");
    visit("radius", self.radius, "Radius of the arc, which is a section of the sphere [m].");
    visit("covariance", self.covariance,
          "Covariance of x z of a tip, of x z radius of an arc, of the distances of the two points across a line "
          "[m^2].");
    visit("sigma", self.sigma, "Noise of a range, given or estimated [m].");
    visit("used", self.used, "Numbers of the points of the profile that show it, from 0.");
    visit("fit", self.fit, "Report of the search.");
  }
};

/// Finds what a profile shows of a target of the given kind; a `fit` that is not usable says why there is nothing.
/// Points off the feature are expected and not used.
///
/// A tip is where its two flanks meet, or its highest point where it is too slender to show flanks; what lies around it
/// must be farther from the scanner. An arc is bulged towards the scanner.
/// @throws InvalidArgument for x and z of different lengths, infinite values, coordinates above 5 m (millimetres read
/// as metres) or invalid options.
ProfileFeature find_profile_feature(const LineProfile& profile, ScanTargetKind kind,
                                    const ProfileFeatureOptions& options = {});

}  // namespace kr5::calibration
