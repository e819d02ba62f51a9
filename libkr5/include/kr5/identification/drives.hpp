// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/core/fit_report.hpp>

/// @file
/// Structure matrix S of the drives, motor angle phi = S q, from encoder counts and joint angles (Hayat et al. 2022,
/// eq. 4.44 to 4.54). Every motor may turn with every joint; which couplings there are is decided by the data.

namespace kr5::identification {

/// Readings of encoders and joints, a row a posture; NaN where nothing was read. Postures of one experiment share their
/// zero.
struct DriveReadings {
  Eigen::MatrixXd counts;  ///< Encoder counts, readings x motors [-].
  Eigen::MatrixXd motor;   ///< Motor angles, readings x motors; may be empty where counts_per_turn is given [rad].
  Eigen::MatrixXd joint;   ///< Joint angles, readings x joints [rad or m].
  std::vector<int> group;  ///< Experiment of each reading; empty: one.

  static void each_field(auto& self, auto&& visit) {
    visit("counts", self.counts, "Encoder counts, readings x motors; empty: motor angles are given instead [-].");
    visit("motor", self.motor, "Motor angles, readings x motors; empty: they follow from counts [rad].");
    visit("joint", self.joint, "Joint angles, readings x joints [rad or m].");
    visit("group", self.group, "Experiment of each reading, whose readings share their zero; empty: one.");
  }
};

struct DriveOptions {
  Eigen::VectorXd counts_per_turn;  ///< [-]
  bool common_zero = false;
  double coupling_false_alarm = 0.01;  ///< [-]
  double outlier_false_alarm = 0.01;   ///< [-]
  double min_coupling = 1e-3;          ///< [-]
  bool common_noise = true;
  bool reject_outliers = true;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("counts_per_turn", self.counts_per_turn,
          "Encoder counts of a turn of each motor; empty: estimated from counts and motor angles [-].");
    visit("common_zero", self.common_zero,
          "Readings relative to a known zero: counts 0 at motor angle 0 at joint angle 0.");
    visit("coupling_false_alarm", self.coupling_false_alarm,
          "Probability that a coupling is reported where there is none, over all of a motor [-].");
    visit("outlier_false_alarm", self.outlier_false_alarm,
          "Probability of a false outlier in sound readings, over all readings of a motor [-].");
    visit("min_coupling", self.min_coupling,
          "Coupling, relative to the motor's own ratio, below which it counts as none [-].");
    visit("common_noise", self.common_noise, "Joint readings with the same noise.");
    visit("reject_outliers", self.reject_outliers, "Exclusion of outliers from the estimate.");
  }
};

/// A reading that contradicts the others.
struct DriveOutlier {
  int motor = 0;              ///< From 1.
  int reading = 0;            ///< Row, from 1.
  double residual = 0.0;      ///< Of the joint angle that the motor angle asks for [rad or m].
  double significance = 1.0;  ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("motor", self.motor, "Motor, from 1.");
    visit("reading", self.reading, "Row of the readings, from 1.");
    visit("residual", self.residual, "Joint angle read minus the one that the others predict [rad or m].");
    visit("significance", self.significance, "Probability of such a residual in a sound reading [-].");
  }
};

/// An element of S beside its diagonal that the data show.
struct DriveCoupling {
  int motor = 0;              ///< From 1.
  int joint = 0;              ///< From 1.
  double value = 0.0;         ///< [-]
  double sigma = 0.0;         ///< [-]
  double significance = 1.0;  ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("motor", self.motor, "Motor, from 1.");
    visit("joint", self.joint, "Joint that turns it, from 1.");
    visit("value", self.value, "Turns of the motor per turn of the joint [-].");
    visit("sigma", self.sigma, "Standard deviation of the value [-].");
    visit("significance", self.significance, "Probability of such an estimate where there is no coupling [-].");
  }
};

/// An element of S beside its diagonal that the readings cannot show: the joint was not moved, or not read, beside the
/// motor.
struct UnseenCoupling {
  int motor = 0;  ///< From 1.
  int joint = 0;  ///< From 1.
  std::string text;

  static void each_field(auto& self, auto&& visit) {
    visit("motor", self.motor, "Motor, from 1.");
    visit("joint", self.joint, "Joint of which it is not known whether it turns the motor, from 1.");
    visit("text", self.text, "The same in words, with the reason.");
  }
};

struct DriveResult {
  Eigen::MatrixXd structure;                ///< S, motors x joints; zero where no coupling was found [-].
  Eigen::MatrixXd sigma;                    ///< Standard deviations of its elements [-].
  std::vector<Eigen::MatrixXd> covariance;  ///< Of each row of S, joints x joints [-].
  Eigen::VectorXd counts_per_turn;          ///< [-]
  Eigen::MatrixXd counts_per_joint;         ///< T_j of eq. 4.48, motors x joints [1/rad or 1/m].
  Eigen::VectorXd noise;                    ///< Standard deviation of a joint reading, by motor [rad or m].
  std::vector<DriveCoupling> couplings;
  std::vector<UnseenCoupling> unseen;
  std::vector<DriveOutlier> outliers;
  std::vector<std::string> warnings;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("structure", self.structure, "Structure matrix S, motors x joints: motor angle = S q [-].");
    visit("sigma", self.sigma, "Standard deviations of the elements of S; 0 where an element is no parameter [-].");
    visit("covariance", self.covariance, "Covariance of each row of S, joints x joints [-].");
    visit("counts_per_turn", self.counts_per_turn, "Encoder counts of a turn of each motor [-].");
    visit("counts_per_joint", self.counts_per_joint,
          "Encoder counts per joint angle, T_j of eq. 4.48, motors x joints [1/rad or 1/m].");
    visit("noise", self.noise, "Standard deviation of a joint reading, seen by each motor [rad or m].");
    visit("couplings", self.couplings, "Elements beside the diagonal that the data show.");
    visit("unseen", self.unseen, "Elements beside the diagonal that the readings cannot show.");
    visit("outliers", self.outliers, "Readings that contradict the others.");
    visit("warnings", self.warnings, "Reasons for doubt.");
    visit("fit", self.fit, "Status of the estimation.");
  }
};

/// Structure matrix, counts per turn and couplings by least squares, a motor at a time. The noise is that of the joint
/// readings, which is small beside the motion. A coupling stays while a t-test beside all others shows it (backward
/// elimination); a reading is an outlier by its externally studentised residual.
/// @throws InvalidArgument for sizes that differ, numbers that are not finite, or invalid options.
DriveResult identify_drives(const DriveReadings& readings, const DriveOptions& options = {});

}  // namespace kr5::identification
