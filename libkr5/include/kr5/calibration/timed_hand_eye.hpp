// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Hand-eye calibration from two time-stamped pose streams whose clocks differ by an unknown offset.

namespace kr5::calibration {

/// Poses and when they were taken. Order does not matter; of poses with equal time stamps the first counts.
struct PoseStream {
  std::vector<double> t;  ///< [s]
  std::vector<Pose> poses;

  static void each_field(auto& self, auto&& visit) {
    visit("t", self.t, "Time of each pose, by the clock of this stream [s].");
    visit("poses", self.poses, "Poses, in the order of `t`.");
  }
};

struct TimedHandEyeOptions {
  double max_offset = 2.0;     ///< [s]
  double max_gap = 0.15;       ///< [s]
  double window = 0.4;         ///< [s]
  double min_duration = 5.0;   ///< [s]
  double min_rotation = 0.02;  ///< [rad]
  double min_correlation = 0.6;
  double tail = 5.0;
  int max_iterations = 100;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("max_offset", self.max_offset, "Maximum offset of the clocks [s].");
    visit("max_gap", self.max_gap, "Longest gap of the hand stream across which poses are interpolated [s].");
    visit("window", self.window, "Time over which the angular speed is computed for the initial offset [s].");
    visit("min_duration", self.min_duration, "Minimum common duration of both streams [s].");
    visit("min_rotation", self.min_rotation, "Minimum RMS rotation about the second axis for a calibration [rad].");
    visit("min_correlation", self.min_correlation, "Minimum correlation of the angular speeds for a calibration [-].");
    visit("tail", self.tail,
          "Degrees of freedom of the error's t distribution: lower values reduce the weight of outliers.");
    visit("max_iterations", self.max_iterations, "Maximum number of iterations of the refinement.");
  }
};

/// The speed of turning of both streams, as used for the first guess and for the plot.
struct SpeedAlignment {
  std::vector<double> t_hand;    ///< [s]
  std::vector<double> hand;      ///< [rad/s]
  std::vector<double> t_camera;  ///< [s]
  std::vector<double> camera;    ///< [rad/s]
  double offset = 0.0;           ///< [s]
  double correlation = 0.0;

  static void each_field(auto& self, auto&& visit) {
    visit("t_hand", self.t_hand, "Time by the hand's clock [s].");
    visit("hand", self.hand, "Angular speed of the hand [rad/s].");
    visit("t_camera", self.t_camera, "Time by the camera's clock [s].");
    visit("camera", self.camera, "Angular speed of the camera [rad/s].");
    visit("offset", self.offset, "Initial offset: t_camera = t_hand + offset [s].");
    visit("correlation", self.correlation, "Correlation of both at that offset [-].");
  }
};

struct TimedHandEyeResult {
  double offset = 0.0;      ///< [s]
  double offset_std = 0.0;  ///< [s]
  Pose T_hand_camera = Pose::Identity();
  Pose T_base_world = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();        ///< [m, rad]
  Matrix6 covariance_world = Matrix6::Zero();  ///< [m, rad]
  double covariance_dof = 0.0;                 ///< [-]
  double sigma_position = 0.0;                 ///< [m]
  double sigma_rotation = 0.0;                 ///< [rad]
  double correlation_time = 0.0;               ///< [s]
  int used = 0;
  int outliers = 0;
  double spread_median = 0.0;  ///< [m]
  double spread_rms = 0.0;     ///< [m]
  SpeedAlignment alignment;
  std::string cause;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("offset", self.offset, "Clock offset: t_camera = t_hand + offset [s].");
    visit("offset_std", self.offset_std, "Standard deviation of the offset, with the errors' correlation in time [s].");
    visit("T_hand_camera", self.T_hand_camera, "Pose of the camera on the hand.");
    visit("T_base_world", self.T_base_world, "Pose of the camera's world (the target) in the base.");
    visit("covariance", self.covariance,
          covariance_doc("T_hand_camera", "Covariance of T_hand_camera, right perturbation [m, rad]."));
    visit("covariance_world", self.covariance_world,
          covariance_doc("T_base_world", "Covariance of T_base_world, right perturbation [m, rad]."));
    visit("covariance_dof", self.covariance_dof,
          "Degrees of freedom behind both covariances, by which they and offset_std are already inflated [-].");
    visit("sigma_position", self.sigma_position,
          "Standard deviation of the camera's position, both streams together, per axis [m].");
    visit("sigma_rotation", self.sigma_rotation,
          "Standard deviation of its orientation, both streams together, per axis [rad].");
    visit("correlation_time", self.correlation_time, "Correlation time of the errors [s].");
    visit("used", self.used, "Number of camera poses used.");
    visit("outliers", self.outliers, "Number of camera poses of negligible weight among them.");
    visit("spread_median", self.spread_median, "Median distance of T_base_world by single poses from their mean [m].");
    visit("spread_rms", self.spread_rms, "RMS of that distance [m].");
    visit("alignment", self.alignment, "Angular speed of both streams.");
    visit("cause", self.cause,
          "Cause of a missing result: no_overlap | too_short | no_motion | one_axis | no_correlation | "
          "quaternion_order_hand | quaternion_order_camera | quaternion_order_both | inverted; empty otherwise.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Estimates clock offset, camera on the hand and world in the base together: `hand` holds T_base_hand, `camera` holds
/// T_world_camera, and T_base_hand(t) T_hand_camera = T_base_world T_world_camera(t + offset).
///
/// Correlation of the speeds of turning gives the first guess (Furrer et al., FSR 2017); then the hand stream is
/// interpolated at the camera's times and all thirteen numbers are refined with t-distributed errors of estimated
/// covariance. The uncertainty comes from how the errors scatter and how they fade in time.
/// Streams that do not suffice give FitStatus::Degenerate, `cause`, and words in `fit.message`.
/// @throws InvalidArgument for streams with fewer than ten poses, unequal lengths, poses or times that are not finite.
TimedHandEyeResult calibrate_timed_hand_eye(const PoseStream& hand, const PoseStream& camera,
                                            const TimedHandEyeOptions& options = {});

/// Pose of the world in the base from each camera pose, for a given result: its evaluation on data that were not
/// fitted. Camera times that the hand stream does not cover are left out.
std::vector<Pose> world_in_base(const PoseStream& hand, const PoseStream& camera, const TimedHandEyeResult& result,
                                double max_gap = TimedHandEyeOptions().max_gap);

/// Median and RMS distance of positions from their mean [m].
std::pair<double, double> position_spread(const std::vector<Pose>& poses);

}  // namespace kr5::calibration
