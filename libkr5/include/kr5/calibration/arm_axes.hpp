// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <kr5/calibration/circle_point.hpp>
#include <kr5/calibration/turn_findings.hpp>
#include <kr5/core/fit_report.hpp>
#include <kr5/kinematics/deviated_arm.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Joint axes and Denavit-Hartenberg parameters of a whole arm from turns of single joints, without nominal values
/// (Hayat et al. 2022, section 4.2).

namespace kr5::calibration {

struct ArmAxesOptions {
  JointAxisOptions axis = {};
  TurnFindingOptions findings = {};
  std::optional<kinematics::DhChain> nominal = std::nullopt;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("axis", self.axis, "Options of the axis of each joint.");
    visit("findings", self.findings, "Limits beyond which something is found.");
    visit("nominal", self.nominal, "Nominal arm, by which mirrored and scaled measurements are found; not fitted.");
  }
};

/// An identified parameter of the arm.
struct ArmParameter {
  int joint = 0;
  kinematics::DhParameter parameter = kinematics::DhParameter::A;
  double value = 0.0;
  double std = 0.0;

  static void each_field(auto& self, auto&& visit) {
    visit("joint", self.joint, "Joint, from 0.");
    visit("parameter", self.parameter, "Parameter of its row: b | theta | a | alpha | beta.");
    visit("value", self.value, "Estimated value [m or rad].");
    visit("std", self.std, "Standard deviation, inflated so that twice it is a 95 % interval [m or rad].");
  }
};

struct ArmAxesResult {
  std::vector<JointAxisResult> axes;
  kinematics::DhChain arm;
  Eigen::VectorXd home;  ///< [rad]
  std::vector<ArmParameter> parameters;
  Eigen::MatrixXd covariance;
  TurnFindings findings;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("axes", self.axes, "Axis of each joint, from the base; each has its own fit.");
    visit("arm", self.arm,
          "Arm in the frame of the device; its last frame has its origin where the first point, or the tool, is when "
          "every joint is at home.");
    visit("home", self.home, "Joint values at which the others stood while one joint turned [rad].");
    visit("parameters", self.parameters,
          "Parameters that the axes determine, joint by joint: not b and theta_offset of the first joint, which place "
          "the first frame, not those of the last row, which ends in what was measured, and beside near-parallel axes "
          "beta in place of b.");
    visit("covariance", self.covariance,
          covariance_doc("parameters", "Covariance of the parameters, in their order [m, rad]."));
    visit("findings", self.findings, "Reasons to doubt several turns together; those of one turn are with its axis.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Identifies the axis of each joint by identify_joint_axis and the arm that has these axes by
/// kinematics::chain_from_axes. Covariances of the parameters follow from those of the axes to first order.
///
/// An axis that its turn does not determine gives FitStatus::Degenerate with the reason; then there is no arm.
/// @param turns Samples of each joint's turn, from the base, while the others stood at home.
/// @param home  Joint values at which the others stood, one a turn [rad]. A turn whose samples have no joint values is
///              taken to begin at home.
/// @throws InvalidArgument for no turn, a turn that identify_joint_axis refuses, a home of another size or that is not
///         finite, or invalid options.
ArmAxesResult identify_arm_axes(std::span<const std::vector<JointSample>> turns, const Eigen::VectorXd& home,
                                const ArmAxesOptions& options = {});

}  // namespace kr5::calibration
