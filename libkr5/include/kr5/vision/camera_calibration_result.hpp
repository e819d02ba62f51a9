// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// What a camera calibration returns.

namespace kr5::vision {

/// One view under the result.
struct CameraViewReport {
  std::string name;
  Pose T_camera_target = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< Right perturbation [m, rad].
  double rms_px = 0.0;                   ///< [px]
  double noise_px = 0.0;                 ///< [px]
  double weight = 1.0;                   ///< [-]
  double influence = 0.0;                ///< [-]
  double probability = 1.0;              ///< [-]
  double tilt = 0.0;                     ///< [rad]
  bool outlier = false;
  std::string reason;
  Eigen::Matrix2Xd residuals;  ///< [px]
  Eigen::VectorXd weights;     ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the view.");
    visit("T_camera_target", self.T_camera_target, "Pose of the target in the camera.");
    visit("covariance", self.covariance,
          covariance_doc(
              "T_camera_target",
              "Covariance of T_camera_target, right perturbation, the uncertainty of the camera included [m, rad]."));
    visit("rms_px", self.rms_px, "RMS distance of seen and predicted points [px].");
    visit("noise_px", self.noise_px, "Noise of the view's points per axis, by a robust scale [px].");
    visit("weight", self.weight, "Weight of the view in the fit; 1 for one of average noise, 0 when left out [-].");
    visit("influence", self.influence,
          "Squared distance of the view's camera from that of all others, in standard deviations and per parameter: "
          "about 1 for a sound view [-].");
    visit("probability", self.probability, "Probability that a sound view has at least this influence [-].");
    visit("tilt", self.tilt, "Angle between the optical axis and the normal of the target [rad].");
    visit("outlier", self.outlier, "Contradiction to the other views beyond the noise.");
    visit("reason", self.reason, "Reason why the view is an outlier.");
    visit("residuals", self.residuals, "Residuals, seen minus predicted, 2 x n [px].");
    visit("weights", self.weights, "Weight of each point within its view [-].");
  }
};

/// One model among those compared.
struct CameraModelScore {
  LensModel lens = LensModel::None;
  bool square_pixels = false;
  bool bent_target = false;
  int parameters = 0;
  double held_out_rms = 0.0;  ///< [px]
  double fitted_rms = 0.0;    ///< [px]
  double excess = 0.0;        ///< [px^2]
  double excess_std = 0.0;    ///< [px^2]
  bool chosen = false;

  static void each_field(auto& self, auto&& visit) {
    visit("lens", self.lens, "Lens model.");
    visit("square_pixels", self.square_pixels, "Square pixels, fx = fy.");
    visit("bent_target", self.bent_target, "Estimation of the target's shape.");
    visit("parameters", self.parameters, "Free parameters, poses not counted.");
    visit("held_out_rms", self.held_out_rms, "RMS distance of points in held-out views [px].");
    visit("fitted_rms", self.fitted_rms, "RMS distance of points in the fitted views [px].");
    visit("excess", self.excess, "Mean squared held-out error above that of the best model [px^2].");
    visit("excess_std", self.excess_std, "Standard error of `excess`, paired over views [px^2].");
    visit("chosen", self.chosen, "Whether this model was chosen for the result.");
  }
};

/// What of the image and of the possible directions the views cover.
struct CameraCoverage {
  Eigen::MatrixXd counts;                                ///< Points per cell.
  double cells_hit = 0.0;                                ///< [-]
  double largest_gap = 0.0;                              ///< [-]
  Eigen::Vector4d gap_region = Eigen::Vector4d::Zero();  ///< [px]
  double tilt_min = 0.0;                                 ///< [rad]
  double tilt_max = 0.0;                                 ///< [rad]
  double distance_ratio = 1.0;                           ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("counts", self.counts, "Number of points in each cell of a grid of 8 rows and 10 columns over the image.");
    visit("cells_hit", self.cells_hit, "Share of the cells with a point [-].");
    visit("largest_gap", self.largest_gap, "Share of the image in the largest rectangle without a point [-].");
    visit("gap_region", self.gap_region, "Largest rectangle without a point: left, top, right, bottom [px].");
    visit("tilt_min", self.tilt_min, "Minimum tilt of the target relative to the image [rad].");
    visit("tilt_max", self.tilt_max, "Largest tilt of the target relative to the image [rad].");
    visit("distance_ratio", self.distance_ratio, "Distance of the farthest over that of the nearest target [-].");
  }
};

/// Something a person should know.
struct CameraFinding {
  std::string cause;  ///< Identifier, e.g. `views_alike`.
  std::string text;
  std::string remedy;
  std::string evidence;
  bool severe = false;

  static void each_field(auto& self, auto&& visit) {
    visit("cause", self.cause,
          "too_few_views | views_alike | fronto_parallel | uncertain | coverage | spoiling_view | mirrored_view | "
          "noisy_corners | views_disagree | bent_target | second_minimum.");
    visit("text", self.text, "Description of the finding.");
    visit("remedy", self.remedy, "Remedy.");
    visit("evidence", self.evidence, "Figures behind the finding.");
    visit("severe", self.severe, "Whether the finding makes the result unusable.");
  }
};

struct CameraCalibration {
  using Covariance = Eigen::Matrix<double, Pinhole::parameter_count, Pinhole::parameter_count>;

  Pinhole camera;
  LensModel lens = LensModel::None;
  bool square_pixels = false;
  bool bent_target = false;
  std::vector<std::string> free;               ///< Names of the free parameters; with square pixels fy follows fx.
  Covariance covariance = Covariance::Zero();  ///< Order of Pinhole::parameters; fixed ones are 0.
  Eigen::Matrix<double, 5, 1> target_shape = Eigen::Matrix<double, 5, 1>::Zero();  ///< [-]
  double sigma_pixel = 0.0;                                                        ///< [px]
  double dispersion = 1.0;                                                         ///< [-]
  double rms_px = 0.0;                                                             ///< [px]
  double held_out_rms = 0.0;                                                       ///< [px]
  std::vector<CameraViewReport> views;                                             ///< In input order.
  std::vector<CameraModelScore> models;
  CameraCoverage coverage;
  std::vector<CameraFinding> findings;
  FitReport fit;  ///< Look at `fit.usable()` before the camera.

  static void each_field(auto& self, auto&& visit) {
    visit("camera", self.camera, "Camera.");
    visit("lens", self.lens, "Lens model used.");
    visit("square_pixels", self.square_pixels, "Square pixels, fx = fy.");
    visit("bent_target", self.bent_target, "Estimation of the target's shape.");
    visit("free", self.free, "Names of the free parameters; with square pixels fy follows fx.");
    visit("covariance", self.covariance,
          covariance_doc("camera.fx camera.fy camera.cx camera.cy camera.k1 camera.k2 camera.p1 camera.p2 camera.k3 "
                         "camera.k4 camera.k5 camera.k6",
                         "Covariance of fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6; fixed ones are 0."));
    visit("target_shape", self.target_shape, "Bow xx, xy, yy; stretch; shear of a flat target, in half its size [-].");
    visit("sigma_pixel", self.sigma_pixel, "Standard deviation of a point per axis [px].");
    visit("dispersion", self.dispersion,
          "Disagreement of the views over what their noise allows; the covariance is inflated by it [-].");
    visit("rms_px", self.rms_px, "RMS distance of seen and predicted points of the views used [px].");
    visit("held_out_rms", self.held_out_rms, "RMS distance of points in held-out views; 0 with too few views [px].");
    visit("views", self.views, "Agreement of each view, in input order.");
    visit("models", self.models, "Models that were compared.");
    visit("coverage", self.coverage, "Coverage of image and directions by the views.");
    visit("findings", self.findings, "Findings for the user.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

}  // namespace kr5::vision
