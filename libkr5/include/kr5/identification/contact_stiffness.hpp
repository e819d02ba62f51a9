// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/core/fit_report.hpp>

/// @file
/// Stiffness and position of a contact from force against depth (Hayat et al. 2022, eq. 5.14).

namespace kr5::identification {

/// Readings of one axis, positive into the contact.
struct ContactLog {
  Eigen::VectorXd depth;        ///< Position of the tool [m].
  Eigen::VectorXd force;        ///< Force of the tool on what it presses [N].
  Eigen::VectorXd t;            ///< Times, for the damping; or empty [s].
  std::vector<int> run_starts;  ///< First reading of each run, 0 first; empty: one run.

  /// @throws InvalidArgument naming field and row: sizes that differ, numbers that are not finite, times that do not
  ///         rise within a run.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("depth", self.depth, "Position of the tool along the axis, positive into the contact [m].");
    visit("force", self.force, "Force of the tool on what it presses [N].");
    visit("t", self.t, "Times of the readings, for the damping; or empty [s].");
    visit("run_starts", self.run_starts, "First reading of each run, 0 first; empty: one run.");
  }
};

struct ContactStiffnessOptions {
  double position_noise = 0.0;
  double force_noise = 0.0;
  bool fit_damping = false;
  bool fit_hardening = false;
  double outlier_limit = 4.5;
  double accepted_std = 0.3;
  int seed = 1;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("position_noise", self.position_noise,
          "Standard deviation of a depth, for errors in both variables; 0: depths are exact [m].");
    visit("force_noise", self.force_noise, "Standard deviation of a force; 0: from the readings [N].");
    visit("fit_damping", self.fit_damping, "Estimate the damping, from the times of the readings.");
    visit("fit_hardening", self.fit_hardening, "Estimate the growth of the stiffness over the depth.");
    visit("outlier_limit", self.outlier_limit,
          "Residual beyond which a reading is left out, in standard deviations [-].");
    visit("accepted_std", self.accepted_std,
          "Relative standard deviation of the stiffness above which readings are refused [-].");
    visit("seed", self.seed, "Seed of the robust start.");
  }
};

struct ContactStiffnessResult {
  double stiffness = 0.0;
  double position = 0.0;
  double force_offset = 0.0;
  double damping = 0.0;
  double hardening = 0.0;
  std::optional<double> unloading_stiffness;
  Eigen::MatrixXd covariance;
  double noise = 0.0;
  int free_readings = 0;
  int contact_readings = 0;
  std::vector<int> outliers;
  Eigen::VectorXd predicted;
  std::vector<std::string> warnings;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("stiffness", self.stiffness, "Stiffness k_e; of the way in when loading and unloading differ [N/m].");
    visit("position", self.position, "Position z_e of the tool at which contact begins [m].");
    visit("force_offset", self.force_offset, "Force reading without contact [N].");
    visit("damping", self.damping, "Damping [N s/m].");
    visit("hardening", self.hardening, "Relative growth of the stiffness over the depth [1/m].");
    visit("unloading_stiffness", self.unloading_stiffness,
          "Stiffness of the way out, where it differs from that of the way in [N/m].");
    visit("covariance", self.covariance,
          "Covariance of stiffness [N/m], position [m], force offset [N], damping [N s/m], hardening [1/m] and "
          "unloading less loading stiffness [N/m]; zero for what was not estimated.");
    visit("noise", self.noise, "Standard deviation of the force residuals without contact [N].");
    visit("free_readings", self.free_readings, "Readings before contact.");
    visit("contact_readings", self.contact_readings, "Readings in contact.");
    visit("outliers", self.outliers, "Rows that contradict the others and are left out, counted from 0.");
    visit("predicted", self.predicted, "Fitted force at each reading [N].");
    visit("warnings", self.warnings, "Quantities that the readings do not determine, and evidence against the model.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Fit of F = F_0 + max(k p (1 + h p) + d p', 0), p = z - z_e, the law of `physics::EffectiveContact`: orthogonal
/// distances when the depths have noise, too; readings before contact, outliers and a stiffness of the way out that
/// differs are told apart. `fit.usable()` is false when nothing was touched, when force falls with depth, or when too
/// few readings are in contact; the message says which. @throws InvalidArgument for invalid readings or options.
ContactStiffnessResult identify_contact_stiffness(const ContactLog& log, const ContactStiffnessOptions& options = {});

}  // namespace kr5::identification
