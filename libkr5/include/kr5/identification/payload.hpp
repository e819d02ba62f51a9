// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/identification/dynamics.hpp>

namespace kr5::identification {

struct PayloadOptions {
  Estimator estimator = Estimator::Weighted;  ///< Ordinary, Weighted or Robust.
  bool refit_friction = true;                 ///< Friction and offsets of the joints may differ from those of the arm.
  double huber = 1.345;                       ///< Limit of the Huber loss [standard deviations].
  double min_speed = 0.0;                     ///< Part of the RMS speed below which a joint's rows are left out [-].

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("estimator", self.estimator, "Estimator: ordinary | weighted | robust.");
    visit("refit_friction", self.refit_friction, "Coulomb and viscous friction of each joint estimated anew.");
    visit("huber", self.huber, "Limit of the Huber loss [standard deviations].");
    visit("min_speed", self.min_speed,
          "Fraction of the RMS speed of a joint below which its torques are left out of the fit [-].");
  }
};

/// What the last link carries more than before.
struct PayloadResult {
  FitReport fit;
  kinematics::Body body;        ///< In the frame of the last link, which is the flange.
  Eigen::VectorXd moments;      ///< m, m cx, m cy, m cz, Ixx Ixy Ixz Iyy Iyz Izz about its origin [SI].
  Eigen::MatrixXd covariance;   ///< Of `moments`; with the uncertainty of the arm when that was identified.
  double mass_deviation = 0.0;  ///< Standard deviation [kg].
  Eigen::Vector3d com_deviation = Eigen::Vector3d::Zero();  ///< Standard deviations [m].
  bool possible = false;  ///< Whether such a body can exist: mass and second moments are positive.
  TorqueError fitted;     ///< With payload.
  TorqueError without;    ///< The same motion without it.

  static void each_field(auto& self, auto&& visit) {
    visit("fit", self.fit, "Report of the estimation.");
    visit("body", self.body, "Payload in the frame of the last link.");
    visit("moments", self.moments, "m, m cx, m cy, m cz, Ixx Ixy Ixz Iyy Iyz Izz about the flange's origin [SI].");
    visit("covariance", self.covariance, covariance_doc("moments", "Covariance of the moments [SI]."));
    visit("mass_deviation", self.mass_deviation, "Standard deviation of the mass [kg].");
    visit("com_deviation", self.com_deviation, "Standard deviations of the centre of mass [m].");
    visit("possible", self.possible, "Whether such a body can exist.");
    visit("fitted", self.fitted, "Errors of the torques with the payload.");
    visit("without", self.without, "Errors of the torques without the payload.");
  }
};

/// Payload of an arm whose parameters are known, in the order of DynamicsRegressor.
/// @throws InvalidArgument naming field and remedy.
PayloadResult identify_payload(const JointMotion& loaded, const DynamicsModel& model, const Eigen::VectorXd& parameters,
                               const PayloadOptions& options = {});
/// Payload of an arm that was identified without it, with `identify_dynamics`.
PayloadResult identify_payload(const JointMotion& loaded, const DynamicsResult& arm,
                               const PayloadOptions& options = {});

}  // namespace kr5::identification
