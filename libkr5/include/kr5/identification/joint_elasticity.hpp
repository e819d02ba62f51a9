// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/core/fit_report.hpp>

/// @file
/// Stiffness and play of the gears of an arm from angles on both sides of them and the torques between: the law is that
/// of `physics::GearSpring`. Where only the motor side is measured, `kr5/calibration/kinematics.hpp` finds the
/// compliance of the joints from poses of the sagging arm.

namespace kr5::identification {

/// Angles on both sides of the gears, a row a reading, a column a joint; NaN where nothing was read.
struct ElasticityReadings {
  Eigen::MatrixXd motor;        ///< Motor side, over the gear ratio [rad or m].
  Eigen::MatrixXd link;         ///< Link side [rad or m].
  Eigen::MatrixXd torque;       ///< Through the gear on the link [N m or N].
  std::vector<int> run_starts;  ///< First reading of each run, 0 first; empty: one run.

  static void each_field(auto& self, auto&& visit) {
    visit("motor", self.motor, "Angles of the motor side over the gear ratio, readings x joints [rad or m].");
    visit("link", self.link, "Angles of the link side, readings x joints [rad or m].");
    visit("torque", self.torque,
          "Torques through the gears on the links, without friction and inertia of the motors, readings x joints [N m "
          "or N].");
    visit("run_starts", self.run_starts,
          "First reading of each run of even steps, within which neighbours may have correlated errors, 0 first; "
          "empty: one run.");
  }
};

struct ElasticityOptions {
  Eigen::VectorXd torque_noise = {};  ///< [N m or N]
  bool play = true;
  double play_false_alarm = 0.01;  ///< [-]
  double side_torque = 0.5;        ///< [N m or N]
  double significance = 0.01;      ///< [-]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("torque_noise", self.torque_noise,
          "Standard deviation of the torques, one for all joints or one each, which would make the joints look too "
          "stiff; empty: they are exact [N m or N].");
    visit("play", self.play, "Whether free play is searched for, and kept when the readings show it.");
    visit("play_false_alarm", self.play_false_alarm, "Probability that free play is reported where there is none [-].");
    visit("side_torque", self.side_torque,
          "Torque below which a joint may lie anywhere in its play; such readings are left out where one is looked "
          "for, as are those below four standard deviations of the torque [N m or N].");
    visit("significance", self.significance,
          "Probability that a compliance is reported for a joint that has none [-].");
  }
};

/// Spring of one joint: motor minus link angle = offset + compliance * torque + gap / 2 on the side of the torque.
struct JointSpring {
  int joint = 0;  ///< From 1.
  bool told = false;
  double stiffness = 0.0;       ///< [N m/rad or N/m]
  double stiffness_low = 0.0;   ///< [N m/rad or N/m]
  double stiffness_high = 0.0;  ///< [N m/rad or N/m]
  double compliance = 0.0;      ///< [rad/(N m) or m/N]
  double compliance_std = 0.0;  ///< [rad/(N m) or m/N]
  double offset = 0.0;          ///< [rad or m]
  double offset_std = 0.0;      ///< [rad or m]
  double gap = 0.0;             ///< [rad or m]
  double gap_std = 0.0;         ///< [rad or m]
  Eigen::MatrixXd covariance;
  double noise = 0.0;          ///< [rad or m]
  double torque_spread = 0.0;  ///< [N m or N]
  double attenuation = 1.0;    ///< [-]
  int readings = 0;
  bool doubtful = true;
  std::string message = "not run";

  static void each_field(auto& self, auto&& visit) {
    visit("joint", self.joint, "Joint, from 1.");
    visit("told", self.told, "Whether the readings determine the stiffness.");
    visit("stiffness", self.stiffness, "Stiffness; infinite unless determined [N m/rad or N/m].");
    visit("stiffness_low", self.stiffness_low, "Lower end of its 95 % interval; also where it is not determined.");
    visit("stiffness_high", self.stiffness_high, "Upper end of its 95 % interval; infinite for a rigid one.");
    visit("compliance", self.compliance, "Inverse of the stiffness [rad/(N m) or m/N].");
    visit("compliance_std", self.compliance_std, "Standard deviation of the compliance [rad/(N m) or m/N].");
    visit("offset", self.offset, "Motor side minus link side without a load, of the two zeros [rad or m].");
    visit("offset_std", self.offset_std, "Standard deviation of the offset [rad or m].");
    visit("gap", self.gap, "Whole width of the play; 0: none is seen [rad or m].");
    visit("gap_std", self.gap_std, "Standard deviation of the gap; 0 where none is estimated [rad or m].");
    visit("covariance", self.covariance, "Covariance of offset, compliance and, where there is one, gap.");
    visit("noise", self.noise, "Standard deviation of motor minus link angle about the law [rad or m].");
    visit("torque_spread", self.torque_spread,
          "Standard deviation of the torques, without noise, from which the compliance follows [N m or N].");
    visit("attenuation", self.attenuation,
          "Ratio of the compliance by least squares to the true one, because of the torque noise [-].");
    visit("readings", self.readings, "Number of readings that were used.");
    visit("doubtful", self.doubtful, "Whether the message tells more than that the stiffness is determined.");
    visit("message", self.message, "Explanation.");
  }
};

struct ElasticityResult {
  std::vector<JointSpring> joints;
  FitReport fit;  ///< Look at fit.usable() first.

  static void each_field(auto& self, auto&& visit) {
    visit("joints", self.joints, "Spring of each joint.");
    visit("fit", self.fit, "Status of the estimation: usable when the stiffness of a joint is determined.");
  }
};

/// Spring of each joint by least squares with noise in angles and torques: that of the torques is taken out of their
/// moments (Fuller 1987, section 1.2), whereas plain least squares would make the joint too stiff by 1 + (noise /
/// spread)^2. The noise of the angles is estimated, its correlation from reading to reading, too. A play stays when a
/// t-test shows it; it needs loads of both signs.
///
/// Degenerate when the compliance of no joint differs from 0; a message says why for each.
/// @throws InvalidArgument for sizes that differ, infinite numbers, invalid options, and for motor angles that are not
///         over the gear ratio or torques of the opposite sign, naming the joint.
ElasticityResult identify_elasticity(const ElasticityReadings& readings, const ElasticityOptions& options = {});

}  // namespace kr5::identification
