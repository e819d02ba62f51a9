// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/vision/image.hpp>

/// @file
/// Finds the mouth of a bore in a face whose plane is known, as from a line scanner and the robot's pose (Hayat et al.
/// 2022, section 6.3 and listing C.2: gradient Hough circles, best supported first, back-projected onto the known
/// plane, kept when the radius is right in metres).
///
/// The book looks at the undistorted image, in which a bore seen from the side is an ellipse. Here the image is drawn
/// anew as seen square to the plane, without the lens: there the mouth is a circle from wherever the camera looks, and
/// its radius in pixels is the same at every stand-off, so that one set of Hough parameters holds. The circle found is
/// then measured at its edge in the image itself.

namespace kr5::vision {

struct HoleOptions {
  double radius = 0.0;              ///< [m]
  double radius_tolerance = 5e-4;   ///< [m]
  double search = 0.0;              ///< [m]
  double pixels_per_radius = 30.0;  ///< [px]
  double accumulator_pixel = 1.5;   ///< [px]
  double edge_threshold = 130.0;    ///< [grey]
  double accumulator_votes = 55.0;  ///< [-]
  double min_contrast = 8.0;        ///< [grey]
  double min_seen = 0.7;            ///< [-]
  double sigma_height = 0.0;        ///< [m]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("radius", self.radius, "Radius of the bore; must be given [m].");
    visit("radius_tolerance", self.radius_tolerance,
          "Maximum difference of the measured radius from the given one [m].");
    visit("search", self.search,
          "Half side of the square about the origin of the plane in which the centre may lie; 0: the whole visible "
          "part of the plane [m].");
    visit("pixels_per_radius", self.pixels_per_radius,
          "Radius of the bore in the picture in which circles are searched for [px].");
    visit("accumulator_pixel", self.accumulator_pixel, "Side of a cell of the Hough accumulator, OpenCV's dp [px].");
    visit("edge_threshold", self.edge_threshold, "Upper threshold of Canny's edges, OpenCV's param1 [grey].");
    visit("accumulator_votes", self.accumulator_votes, "Number of votes that a centre needs, OpenCV's param2 [-].");
    visit("min_contrast", self.min_contrast, "Minimum contrast of the edge of the mouth, dark inside [grey].");
    visit("min_seen", self.min_seen, "Minimum visible fraction of the edge of the mouth [-].");
    visit("sigma_height", self.sigma_height,
          "Standard deviation of the position of the plane along its normal; inflates the covariance [m].");
  }
};

enum class HoleStatus {
  Found,
  NoCircle,      ///< Nothing round enough with enough contrast.
  WrongRadius,   ///< Circles, but of another radius.
  Several,       ///< More than one bore of this radius.
  CutByBorder,   ///< The mouth reaches out of the image.
  PlaneNotSeen,  ///< The plane lies behind the camera, is seen from its back, or outside the view.
};
constexpr auto enum_names(HoleStatus) {
  return names<HoleStatus>({{HoleStatus::Found, "found"},
                            {HoleStatus::NoCircle, "no_circle"},
                            {HoleStatus::WrongRadius, "wrong_radius"},
                            {HoleStatus::Several, "several"},
                            {HoleStatus::CutByBorder, "cut_by_border"},
                            {HoleStatus::PlaneNotSeen, "plane_not_seen"}});
}

/// The mouth of a bore in an image. Numbers hold only when it was found.
struct HoleDetection {
  HoleStatus status = HoleStatus::NoCircle;
  std::string message = "not run";                       ///< In words, with the remedy when nothing was found.
  Pose T_camera_hole = Pose::Identity();                 ///< Centre of the mouth, axes of the plane.
  double radius = 0.0;                                   ///< [m]
  double sigma_radius = 0.0;                             ///< [m]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Of the centre, axes of the camera [m^2].
  double rms_px = 0.0;                                   ///< [px]
  int edges = 0;
  std::vector<double> other_radii;  ///< [m]

  bool found() const { return status == HoleStatus::Found; }

  static void each_field(auto& self, auto&& visit) {
    visit("status", self.status, "Whether the bore was found, or why not.");
    visit("message", self.message, "Explanation of the status, with the remedy.");
    visit("T_camera_hole", self.T_camera_hole, "Pose of the mouth in the camera: its centre, with the plane's axes.");
    visit("radius", self.radius, "Radius on the given plane [m].");
    visit("sigma_radius", self.sigma_radius, "Standard deviation of the radius [m].");
    visit("covariance", self.covariance, "Covariance of the centre, in the axes of the camera, 3 x 3 [m^2].");
    visit("rms_px", self.rms_px, "Scatter of the edge about the circle, in pixels of the image [px].");
    visit("edges", self.edges, "Number of places at which the edge of the mouth was measured.");
    visit("other_radii", self.other_radii, "Radii of other circles, when the bore was not found [m].");
  }
};

/// Looks for a bore of `options.radius` in the plane z = 0 of `T_camera_plane`, whose Z points out of the face, towards
/// the camera. The bore must look darker than the face. `T_camera_plane` follows from the robot: T_camera_base of this
/// image times the plane as scanned.
/// @throws InvalidArgument for an empty image, a bad camera, a pose that is no rigid motion, or bad options.
HoleDetection find_hole(ImageView image, const Pinhole& camera, const Pose& T_camera_plane, const HoleOptions& options);

}  // namespace kr5::vision
