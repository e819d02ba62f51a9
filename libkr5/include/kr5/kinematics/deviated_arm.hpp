// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Pose errors of arms whose Denavit-Hartenberg parameters are off: many at once, as a sensitivity analysis wants them
/// (Hayat et al. 2022, section 3.3).

namespace kr5::kinematics {

enum class DhParameter { B, Theta, A, Alpha, Beta };
constexpr auto enum_names(DhParameter) {
  return names<DhParameter>({{DhParameter::B, "b"},
                             {DhParameter::Theta, "theta"},
                             {DhParameter::A, "a"},
                             {DhParameter::Alpha, "alpha"},
                             {DhParameter::Beta, "beta"}});
}

constexpr bool is_length(DhParameter parameter) { return parameter == DhParameter::B || parameter == DhParameter::A; }

/// The number of a row that a parameter names [m or rad].
double& value_of(DhJoint& joint, DhParameter parameter);
double value_of(const DhJoint& joint, DhParameter parameter);

/// A parameter of one joint.
struct JointParameter {
  int joint = 0;
  DhParameter parameter = DhParameter::B;

  /// As in tables: b1, theta1, a1, alpha1, beta1 for the first joint.
  std::string label() const;
  bool is_length() const { return kinematics::is_length(parameter); }

  static void each_field(auto& self, auto&& visit) {
    visit("joint", self.joint, "Joint, from 0.");
    visit("parameter", self.parameter, "Parameter of its row: b | theta | a | alpha | beta.");
  }
};

/// The parameters b, theta, a and alpha of every joint of a chain, joint by joint.
std::vector<JointParameter> joint_parameters(const DhChain& chain);

/// An arm of which parameters are off, beside the nominal one.
struct DeviatedArm {
  DhChain nominal;
  std::vector<JointParameter> parameters;
  Eigen::VectorXd q;
  bool joints_vary = false;

  /// Errors of the flange, N x 6: position [m] and rotation vector of R R_nominal^T [rad], both in B, for deviations
  /// of the parameters in each row [m or rad]; where the joints vary, joint values [rad or m] follow in the row, and
  /// the nominal arm stands at them, too.
  /// @throws InvalidArgument for rows of another length, or a parameter or posture that the chain has not.
  Rows errors(const Eigen::Ref<const Rows>& deviations) const;

  static void each_field(auto& self, auto&& visit) {
    visit("nominal", self.nominal, "Nominal arm.");
    visit("parameters", self.parameters, "Parameters that are off.");
    visit("q", self.q, "Posture [rad or m].");
    visit("joints_vary", self.joints_vary, "Whether each row has a posture of its own.");
  }
};

}  // namespace kr5::kinematics
