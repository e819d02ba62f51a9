// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/arm_axes.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include <kr5/core/error.hpp>

#include "calibration/kinematics/arm_parameters.hpp"
#include "calibration/kinematics/home_place.hpp"

namespace kr5::calibration {
namespace {

JointAxisResult axis_of_joint(std::size_t k, std::span<const JointSample> turn, const JointAxisOptions& options) {
  try {
    return identify_joint_axis(turn, options);
  } catch (const InvalidArgument& problem) {
    throw InvalidArgument("joint " + std::to_string(k + 1) + ": " + problem.what());
  }
}

/// Whether all axes were found, with the first that was not.
FitReport joint_report(std::span<const JointAxisResult> axes) {
  FitReport out{.status = FitStatus::Converged};
  double initial = 0.0, final = 0.0;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const FitReport& fit = axes[k].fit;
    if (!fit.usable())
      return {.status = FitStatus::Degenerate, .message = "joint " + std::to_string(k + 1) + ": " + fit.message};
    if (fit.status == FitStatus::MaxIterations) out.status = fit.status;
    out.iterations = std::max(out.iterations, fit.iterations);
    initial += fit.initial_rms * fit.initial_rms, final += fit.final_rms * fit.final_rms;
  }
  const auto count = static_cast<double>(axes.size());
  out.initial_rms = std::sqrt(initial / count), out.final_rms = std::sqrt(final / count);
  out.message = std::to_string(axes.size()) + " axes";
  return out;
}

bool has_finite_parameters(const kinematics::DhJoint& joint) {
  const double all[] = {joint.b, joint.theta_offset, joint.a, joint.alpha, joint.beta};
  return std::all_of(std::begin(all), std::end(all), [](double value) { return std::isfinite(value); });
}

}  // namespace

void ArmAxesOptions::validate() const {
  axis.validate();
  findings.validate();
  if (!nominal) return;
  require(nominal->T_base_0.matrix().allFinite() && std::ranges::all_of(nominal->joints, has_finite_parameters),
          "nominal: T_base_0 and all parameters must be finite [m, rad]");
  for (const kinematics::DhJoint& joint : nominal->joints)
    require(joint.type == kinematics::JointType::Revolute, "nominal: every joint must be revolute");
}

ArmAxesResult identify_arm_axes(std::span<const std::vector<JointSample>> turns, const Eigen::VectorXd& home,
                                const ArmAxesOptions& options) {
  options.validate();
  require(!turns.empty(), "turns: there is none");
  require(home.size() == static_cast<Eigen::Index>(turns.size()),
          "home: expected " + std::to_string(turns.size()) + " joint values, found " + std::to_string(home.size()));
  require(home.allFinite(), "home must be finite [rad]");
  ArmAxesResult out;
  out.home = home;
  for (std::size_t k = 0; k < turns.size(); ++k) out.axes.push_back(axis_of_joint(k, turns[k], options.axis));
  out.fit = joint_report(out.axes);
  if (!out.fit.usable()) return out;
  std::vector<kinematics::AxisLine> lines;
  for (const JointAxisResult& axis : out.axes) lines.push_back(axis.axis);
  const std::optional<HomePlace> place = place_at_home(turns.back(), out.axes.back(), home[home.size() - 1]);
  const Eigen::Vector3d end = place ? place->place : lines.back().point;
  out.arm = arm_of_lines(lines, home, end);
  ArmParameterEstimate estimate = estimate_arm_parameters(out.axes, out.arm, home, end);
  out.parameters = std::move(estimate.parameters);
  out.covariance = std::move(estimate.covariance);
  out.findings =
      find_in_turns(turns, out.axes, out.arm, home, options.nominal ? &*options.nominal : nullptr, options.findings);
  return out;
}

}  // namespace kr5::calibration
