// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/identification/gravity_model.hpp>

/// @file
/// Gravity of an arm in a plane: joints with parallel, horizontal axes, each with one harmonic of the sum of the joint
/// values that turn it (Hayat et al. 2022, eqs. 5.3 to 5.7). Nothing of the arm but the directions of its axes is
/// known.

namespace kr5::identification {

/// What a joint's own gravity torque is a harmonic of, and how the torque of the joints behind it adds to its own.
struct GravityAngle {
  int joint = 0;                 ///< Counted from 0.
  Eigen::VectorXd factors = {};  ///< [-]
  double distal = 1.0;           ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("joint", self.joint, "Joint, counted from 0.");
    visit("factors", self.factors, "Factors of all joint values in the angle psi of the joint: 1, -1 or 0 [-].");
    visit("distal", self.distal,
          "Factor of the torque of the next joint behind in the torque of this one: 1, or -1 for opposite axes [-].");
  }
};

/// The largest set of joints whose axes are horizontal and parallel at a posture, the joint nearest to the flange
/// first. The other joints must stand as they do there.
/// @throws InvalidArgument when q has not one value a joint, or no axis is horizontal.
std::vector<GravityAngle> gravity_angles(const kinematics::DhChain& chain, const Eigen::VectorXd& q,
                                         const Eigen::Vector3d& gravity = {0.0, 0.0, -9.81});

/// Torque of a joint: constant + sine sin(psi) + cosine cos(psi) + distal * torque of the joint behind (eq. 5.5).
struct GravityHarmonic {
  GravityAngle angle = {};
  double constant = 0.0;                          ///< [N m]
  double sine = 0.0;                              ///< [N m]
  double cosine = 0.0;                            ///< [N m]
  double coulomb = 0.0;                           ///< [N m]
  double viscous = 0.0;                           ///< [N m s/rad]
  double residual_rms = 0.0, held_out_rms = 0.0;  ///< [N m]

  static void each_field(auto& self, auto&& visit) {
    visit("angle", self.angle, "Joint and its angle psi.");
    visit("constant", self.constant, "Constant part a0 [N m].");
    visit("sine", self.sine, "Factor a1 of sin(psi) [N m].");
    visit("cosine", self.cosine, "Factor b1 of cos(psi) [N m].");
    visit("coulomb", self.coulomb, "Half the width of the hysteresis, without its viscous part [N m].");
    visit("viscous", self.viscous, "Friction over the speed [N m s/rad].");
    visit("residual_rms", self.residual_rms, "RMS of the residuals [N m].");
    visit("held_out_rms", self.held_out_rms, "RMS error on the samples held out, by a fit of the others [N m].");
  }
};

struct PlanarGravity {
  std::vector<GravityHarmonic> joints;  ///< As the angles were given.
  Eigen::MatrixXd covariance;           ///< [N^2 m^2]
  FitReport fit;                        ///< Look at fit.usable() first.

  /// Torques of these joints in their order. @throws InvalidArgument when a value of a joint is missing.
  GravityPrediction predict(const Eigen::VectorXd& q) const;

  static void each_field(auto& self, auto&& visit) {
    visit("joints", self.joints, "Harmonics, the joint nearest to the flange first.");
    visit("covariance", self.covariance, "Covariance of constant, sine, cosine of the first one, then of the next.");
    visit("fit", self.fit, "Status of the estimation; look at fit.usable first.");
  }
};

/// Fits the harmonics to slow motions, the joint nearest to the flange first (eqs. 5.5 to 5.7), friction told by the
/// two directions. The covariance holds what each joint takes over from those behind it.
///
/// Degenerate when a joint did not move slowly to and fro, or over too small an angle.
/// @param angles The joint nearest to the flange first, as from `gravity_angles`.
/// @throws InvalidArgument for a motion, options or angles that are not valid.
PlanarGravity identify_planar_gravity(const JointMotion& motion, std::span<const GravityAngle> angles,
                                      const GravityOptions& options = {});

}  // namespace kr5::identification
