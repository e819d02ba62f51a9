// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include <kr5/core/fit_report.hpp>
#include <kr5/identification/joint_motion.hpp>
#include <kr5/kinematics/body.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Gravity model of an arm: the torques that hold it, from slow motions, for limits of passive compliance (Hayat et al.
/// 2022, section 5.2).

namespace kr5::identification {

/// Mass that a joint carries, all links behind it together.
struct CarriedMass {
  double mass = 0.0;                                 ///< [kg]
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< Static moment about the joint, in axes of B [kg m].

  static void each_field(auto& self, auto&& visit) {
    visit("mass", self.mass, "Mass behind the joint [kg].");
    visit("moment", self.moment, "Its static moment about the origin of the joint, in axes of B [kg m].");
  }
};

/// Backward recursion of the static mass moment over the links (Hayat et al. 2022, eqs. 5.1, 5.2 and 5.4), one a joint.
/// @throws InvalidArgument when the numbers of joints, bodies and values differ.
std::vector<CarriedMass> carried_masses(const kinematics::DhChain& chain, std::span<const kinematics::Body> bodies,
                                        const Eigen::VectorXd& q);
/// Torques that hold these masses: -e . (moment x g) of a joint with axis e, -e . g mass of a slide [N m or N].
/// @param gravity In B [m/s^2].
Eigen::VectorXd holding_torques(const kinematics::DhChain& chain, std::span<const CarriedMass> carried,
                                const Eigen::VectorXd& q, const Eigen::Vector3d& gravity = {0.0, 0.0, -9.81});

struct GravityOptions {
  Eigen::Vector3d gravity = {0.0, 0.0, -9.81};  ///< In B [m/s^2].
  double min_speed = 0.005;                     ///< [rad/s or m/s]
  double max_speed = 0.3;                       ///< [rad/s or m/s]
  double held_out = 1.0 / 3.0;                  ///< [-]
  bool viscous = true;
  bool offset = false;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("gravity", self.gravity, "Gravity in B [m/s^2].");
    visit("min_speed", self.min_speed,
          "Speed below which a joint counts as standing: its friction has no known direction [rad/s or m/s].");
    visit("max_speed", self.max_speed,
          "Speed of any joint above which a sample is left out: inertia is not part of the model [rad/s or m/s].");
    visit("held_out", self.held_out, "Last part of the samples of each joint, held out for validation [-].");
    visit("viscous", self.viscous, "Whether friction grows with the speed, for joints that moved at several speeds.");
    visit("offset", self.offset, "Whether the torque of each joint has an offset.");
  }
};

/// Torques that hold a posture.
struct GravityPrediction {
  Eigen::VectorXd tau;    ///< [N m or N]
  Eigen::VectorXd sigma;  ///< [N m or N]

  static void each_field(auto& self, auto&& visit) {
    visit("tau", self.tau, "Torques that hold the posture [N m or N].");
    visit("sigma", self.sigma,
          "Their standard deviations by the covariance of the model; infinite where the motion of the identification "
          "does not determine the torque [N m or N].");
  }
};

/// The mass moments of an arm that its joint torques can tell.
struct GravityModel {
  kinematics::DhChain chain;
  Eigen::Vector3d gravity = {0.0, 0.0, -9.81};  ///< In B [m/s^2].
  std::vector<std::string> names;               ///< One a parameter.
  Eigen::VectorXd parameters;                   ///< [kg m or kg]
  Eigen::MatrixXd covariance;
  Eigen::MatrixXd grouping;  ///< Parameters by m, m cx, m cy, m cz of link 1, then of link 2, ...
  Eigen::MatrixXd untold;

  /// @throws InvalidArgument when q has not one value a joint.
  GravityPrediction predict(const Eigen::VectorXd& q) const;
  /// The given bodies with first moments (of slides: masses) changed to what the model says; the masses that the model
  /// cannot tell stay, and so do the inertias about the centres of mass.
  /// @throws InvalidArgument when there is not one a link, or when the moment of a link without mass would change.
  std::vector<kinematics::Body> bodies(std::span<const kinematics::Body> nominal) const;

  static void each_field(auto& self, auto&& visit) {
    visit("chain", self.chain, "Arm.");
    visit("gravity", self.gravity, "Gravity in B [m/s^2].");
    visit("names", self.names, "Combinations of mass moments that torques determine: m3 c3x + 0.12 m4.");
    visit("parameters", self.parameters, "Their values [kg m or kg].");
    visit("covariance", self.covariance, covariance_doc("parameters", "Covariance of the parameters."));
    visit("grouping", self.grouping,
          "The parameters as combinations of m, m cx, m cy, m cz of link 1, then of link 2, and so on.");
    visit("untold", self.untold, "Directions (columns) of the parameters that the motion does not determine.");
  }
};

struct GravityResult {
  GravityModel model;
  Eigen::VectorXd coulomb, coulomb_sigma;  ///< [N m or N]
  Eigen::VectorXd viscous;                 ///< [N m s/rad or N s/m]
  Eigen::VectorXd offset;                  ///< [N m or N]
  Eigen::VectorXd residual_rms;            ///< [N m or N]
  Eigen::VectorXd held_out_rms;            ///< [N m or N]
  Eigen::VectorXd torque_rms;              ///< [N m or N]
  std::vector<std::string> notes;
  FitReport fit;  ///< Look at fit.usable() first.

  static void each_field(auto& self, auto&& visit) {
    visit("model", self.model, "Gravity model, fitted to all samples.");
    visit("coulomb", self.coulomb,
          "Half the width of the hysteresis of each joint, without its viscous part [N m or N].");
    visit("coulomb_sigma", self.coulomb_sigma, "Its standard deviation; infinite where the joint did not move.");
    visit("viscous", self.viscous, "Friction of each joint over its speed [N m s/rad or N s/m].");
    visit("offset", self.offset, "Offset of the torque of each joint [N m or N].");
    visit("residual_rms", self.residual_rms, "RMS of the residuals of each joint [N m or N].");
    visit("held_out_rms", self.held_out_rms,
          "RMS error of each joint on the samples held out, by a fit of the others [N m or N].");
    visit("torque_rms", self.torque_rms, "RMS torque of each joint on the samples held out [N m or N].");
    visit("notes", self.notes, "Quantities that the motion does not determine.");
    visit("fit", self.fit, "Status of the estimation; look at fit.usable first.");
  }
};

/// Identifies the mass moments of any arm from slow motions (velocities and accelerations so small that torques are
/// gravity and friction), joints moving together or one after the other. Friction is told from gravity by the two
/// directions of the motion: a torque of a joint counts only while that joint moves. Residuals may be correlated in
/// time: their correlation widens the covariance.
///
/// Degenerate when no joint moves slowly, or when one moved in a single direction.
/// @throws InvalidArgument for a motion that is not valid or not of the arm, and for invalid options.
GravityResult identify_gravity(const kinematics::DhChain& chain, const JointMotion& motion,
                               const GravityOptions& options = {});

/// Gravity of an arm from postures at rest, samples x joints each [rad or m], [N m or N]. Friction, whose direction is
/// not known there, is part of the residuals, so that postures are best approached from all sides.
/// @throws InvalidArgument for sizes that are not of the arm, numbers that are not finite, and invalid options.
GravityResult identify_gravity_at_rest(const kinematics::DhChain& chain, const Eigen::MatrixXd& q,
                                       const Eigen::MatrixXd& tau, const GravityOptions& options = {});

/// Whether rows of joint values are postures one after the other rather than samples of a motion: from row to row they
/// jump by more than 0.05 rad or m, and, where they have times, now here, now there.
bool are_postures(const Eigen::MatrixXd& q, bool timed = true);

}  // namespace kr5::identification
