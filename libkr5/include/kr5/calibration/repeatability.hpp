// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Pose repeatability and accuracy after ISO 9283, with confidence bounds (Hayat et al. 2022, appendix B.4).

namespace kr5::calibration {

/// One return of the arm to a point, measured.
struct PoseReturn {
  std::string point;
  Pose T = Pose::Identity();
  std::string name;

  static void each_field(auto& self, auto&& visit) {
    visit("point", self.point, "Name of the point that the arm returned to.");
    visit("T", self.T, "Measured pose, in one frame for all returns.");
    visit("name", self.name, "Name of the return.");
  }
};

/// Where the arm was sent.
struct CommandedPose {
  std::string point;
  Pose T = Pose::Identity();

  static void each_field(auto& self, auto&& visit) {
    visit("point", self.point, "Name of the point.");
    visit("T", self.T, "Commanded pose, in the frame of the measured ones.");
  }
};

struct RepeatabilityOptions {
  double confidence = 0.95;   ///< [-]
  double false_alarm = 0.01;  ///< [-]
  bool leave_out_outliers = false;
  int simulations = 4000;
  int seed = 1;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("confidence", self.confidence, "Confidence of the bounds, two-sided [-].");
    visit("false_alarm", self.false_alarm, "Probability of a false outlier, and of a false drift, in sound data [-].");
    visit("leave_out_outliers", self.leave_out_outliers,
          "Figures without the returns that are named as outliers; the standard counts every return.");
    visit("simulations", self.simulations, "Number of simulated tests behind the bounds.");
    visit("seed", self.seed, "Random seed of the simulated tests.");
  }
};

/// A figure with the bounds that hold the true one with the stated confidence.
struct BoundedFigure {
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;

  static void each_field(auto& self, auto&& visit) {
    visit("value", self.value, "Estimate [m or rad].");
    visit("low", self.low, "Lower bound [m or rad].");
    visit("high", self.high, "Upper bound [m or rad].");
  }
};

/// Figures of one point, or of all points together. Angles A, B, C are those of the deviation from the mean pose, about
/// Z, Y and X of the mean pose (R = Rz(A) Ry(B) Rx(C)), so that they exist whichever way the tool points.
struct PointRepeatability {
  std::string point;
  int returns = 0;
  Pose T_mean = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< [m, rad]
  BoundedFigure RP;                      ///< [m]
  BoundedFigure RR;                      ///< [rad]
  BoundedFigure RR_A, RR_B, RR_C;        ///< [rad]
  std::optional<BoundedFigure> AP;       ///< [m]
  std::optional<BoundedFigure> AR;       ///< [rad]
  Eigen::VectorXd offset;                ///< [m, rad]

  static void each_field(auto& self, auto&& visit) {
    visit("point", self.point, "Name of the point; empty for all points together.");
    visit("returns", self.returns, "Number of returns behind the figures.");
    visit("T_mean", self.T_mean, "Mean pose: barycentre and mean rotation; meaningless for all points together.");
    visit("covariance", self.covariance,
          "Covariance of one return about the mean: x y z in the frame of the measurement, rotation vector in the mean "
          "pose [m, rad].");
    visit("RP", self.RP, "Position repeatability: mean distance from the barycentre plus three of its deviations [m].");
    visit("RR", self.RR, "The same of the rotation angle from the mean orientation [rad].");
    visit("RR_A", self.RR_A, "Orientation repeatability: three standard deviations of A, about Z [rad].");
    visit("RR_B", self.RR_B, "The same of B, about Y [rad].");
    visit("RR_C", self.RR_C, "The same of C, about X [rad].");
    visit("AP", self.AP, "Position accuracy: distance of the barycentre from the commanded position [m].");
    visit("AR", self.AR, "Orientation accuracy: angle of the mean orientation from the commanded one [rad].");
    visit("offset", self.offset,
          "Mean pose less commanded pose: x y z in the frame of the measurement, A B C about Z Y X of the commanded "
          "pose [m, rad]; empty without a commanded pose.");
  }
};

/// A return that stands out.
struct SuspectReturn {
  int index = 0;
  double distance = 0.0;  ///< [m]
  double angle = 0.0;     ///< [rad]
  double probability = 0.0;
  std::string belongs_to;

  static void each_field(auto& self, auto&& visit) {
    visit("index", self.index, "Place of the return in the input, from 0.");
    visit("distance", self.distance, "Distance from the barycentre of the other returns [m].");
    visit("angle", self.angle, "Angle from their mean orientation [rad].");
    visit("probability", self.probability, "Probability that a sound return lies so far off [-].");
    visit("belongs_to", self.belongs_to, "Point that it was measured at, where that is another one; else empty.");
  }
};

/// Motion of the poses from the first return to the last, in the order of the input, common to all points.
struct ReturnDrift {
  Vector6 motion = Vector6::Zero();  ///< [m, rad]
  Vector6 sigma = Vector6::Zero();   ///< [m, rad]
  double probability = 1.0;          ///< [-]
  bool significant = false;

  static void each_field(auto& self, auto&& visit) {
    visit("motion", self.motion,
          "Linear trend over the test: x y z in the frame of the measurement, rotation vector in the mean pose [m, "
          "rad].");
    visit("sigma", self.sigma, "Its standard deviation [m, rad].");
    visit("probability", self.probability, "Probability of such a trend in sound data [-].");
    visit("significant", self.significant, "Whether it is named.");
  }
};

struct RepeatabilityResult {
  std::vector<PointRepeatability> points;  ///< In the order of their first return.
  PointRepeatability overall;
  std::vector<SuspectReturn> outliers;
  ReturnDrift drift;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("points", self.points, "Figures of each point, in the order of their first return.");
    visit("overall", self.overall, "Figures of all deviations from the means of their points.");
    visit("outliers", self.outliers, "Returns that contradict the others of their point, in input order.");
    visit("drift", self.drift, "Trend over the returns.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Repeatability and, where commanded poses are known, accuracy of every point and of all together.
///
/// Bounds of RR_A, RR_B and RR_C are those of a standard deviation (chi-square). RP and RR have no such law: their
/// bounds come from simulated tests with the estimated covariance, the ratio of estimate and true value being
/// the same for every size of the scatter. Those of AP and AR come from the noncentral F distribution, for a mean
/// that is near its command is found too far from it.
/// @throws InvalidArgument for a point with fewer than three returns, a pose that is not finite or not proper, a
///         command for a point without returns, or invalid options.
RepeatabilityResult measure_repeatability(std::span<const PoseReturn> returns,
                                          std::span<const CommandedPose> commanded = {},
                                          const RepeatabilityOptions& options = {});

}  // namespace kr5::calibration
