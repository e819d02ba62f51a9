// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/core/fit_report.hpp>

/// @file
/// Current of a joint over its torque, with the hysteresis that dry friction makes (Hayat et al. 2022, eq. 5.8):
/// I = tau / k_m + alpha + sgn(qd) beta.

namespace kr5::identification {

struct CurrentModelOptions {
  double standstill = 2e-3;  ///< [rad/s or m/s]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("standstill", self.standstill, "Speed at and below which the direction counts as none [rad/s or m/s].");
  }
};

/// The law of one joint.
struct CurrentModel {
  double torque_constant = 0.0;                          ///< k_m [N m/A or N/A]
  double offset = 0.0;                                   ///< alpha [A]
  double hysteresis = 0.0;                               ///< beta [A]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Of the three, in their order.
  double sigma = 0.0;                                    ///< [A]
  double standstill = 2e-3;                              ///< [rad/s or m/s]
  FitReport fit;

  /// Current that a torque asks for at a speed [A].
  double current(double torque, double speed) const;
  /// Torque that a current gives at a speed [N m or N].
  double torque(double current, double speed) const;

  static void each_field(auto& self, auto&& visit) {
    visit("torque_constant", self.torque_constant, "Joint torque over current, k_m [N m/A or N/A].");
    visit("offset", self.offset, "Current without torque, alpha [A].");
    visit("hysteresis", self.hysteresis, "Half the width of the hysteresis, beta [A].");
    visit("covariance", self.covariance,
          covariance_doc("torque_constant offset hysteresis",
                         "Covariance of torque_constant, offset and hysteresis, in this order."));
    visit("sigma", self.sigma, "Standard deviation of the currents about the law [A].");
    visit("standstill", self.standstill, "Speed at and below which the direction counts as none [rad/s or m/s].");
    visit("fit", self.fit, "Status of the estimation.");
  }
};

/// The law by linear least squares of the currents over torque, one and direction. The covariance counts neighbouring
/// samples with the correlation of their residuals (first-order autoregressive). Degenerate when the torque does not
/// vary or the joint moves one way only.
/// @param current [A]; @param torque [N m or N]; @param speed [rad/s or m/s]; of the same samples, in their order.
/// @throws InvalidArgument for sizes that differ or numbers that are not finite.
CurrentModel identify_current_model(const Eigen::VectorXd& current, const Eigen::VectorXd& torque,
                                    const Eigen::VectorXd& speed, const CurrentModelOptions& options = {});

}  // namespace kr5::identification
