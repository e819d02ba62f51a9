// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/further_postures.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>

#include <kr5/core/error.hpp>

namespace kr5::calibration {
namespace {

constexpr double held_parameter = 1e-9;  // standard deviation of parameters that stay [m or rad]

/// What a device measured of a posture: a pose (0), or how many points; -1 where no device did.
int kind_of_place(const ArmPosture& posture) {
  if (posture.T_world_tool) return 0;
  return posture.points.cols() > 0 ? static_cast<int>(posture.points.cols()) : -1;
}

/// The options of the fit, for an arm that stays as it is. Nothing is an outlier: that was decided in the fit.
KinematicsOptions arm_held(KinematicsOptions options, std::vector<std::string> hold) {
  options.hold = std::move(hold);
  options.tolerance_length = options.tolerance_angle = held_parameter;
  options.joint_errors = options.elasticity = false;
  options.outlier_false_alarm = 0.0;
  return options;
}

/// What is held in a fit without parameters of the arm.
std::vector<std::string> held_beside_arm(const std::vector<std::string>& hold) {
  std::vector<std::string> out;
  std::copy_if(hold.begin(), hold.end(), std::back_inserter(out),
               [](const std::string& name) { return !name.starts_with("arm") && !name.starts_with("joint_errors"); });
  return out;
}

/// Postures with the joint values at which the identified arm stood.
std::vector<ArmPosture> as_they_stood(const KinematicsResult& result, std::span<const ArmPosture> postures) {
  std::vector<ArmPosture> out(postures.begin(), postures.end());
  for (ArmPosture& posture : out)
    posture.q = result.corrected(posture.q, result.compliances.size() > 0 ? posture.torques : Eigen::VectorXd());
  return out;
}

std::vector<ArmPosture> sound_postures_of(const KinematicsResult& result, std::span<const ArmPosture> fitted) {
  require(result.postures.size() == fitted.size(), "fitted: found " + std::to_string(fitted.size()) +
                                                       " postures, the result has " +
                                                       std::to_string(result.postures.size()));
  std::vector<ArmPosture> out;
  for (std::size_t i = 0; i < fitted.size(); ++i)
    if (!result.postures[i].outlier) out.push_back(fitted[i]);
  return out;
}

/// Distance of the measured points from where the arm puts them; RMS over those that were seen.
double place_error(const KinematicsResult& result, const ArmPosture& posture) {
  const Pose T = result.T_world_base * result.flange(posture.q, posture.torques);
  if (posture.T_world_tool)
    return (T * result.T_flange_tool.translation() - posture.T_world_tool->translation()).norm();
  require(posture.points.cols() == result.points.cols(),
          "further: a posture has " + std::to_string(posture.points.cols()) + " points, the result " +
              std::to_string(result.points.cols()));
  double squares = 0.0, seen = 0.0;
  for (Eigen::Index k = 0; k < posture.points.cols(); ++k) {
    const Eigen::Vector3d off = T * Eigen::Vector3d(result.points.col(k)) - posture.points.col(k);
    if (off.allFinite()) squares += off.squaredNorm(), seen += 1;
  }
  require(seen > 0, "further: nothing was measured of posture " + posture.name);
  return std::sqrt(squares / seen);
}

std::vector<double> place_errors(const KinematicsResult& result, std::span<const ArmPosture> postures) {
  std::vector<double> out;
  for (const ArmPosture& posture : postures) out.push_back(place_error(result, posture));
  return out;
}

/// Errors by a fit that placed an arm, whose report counts among those before; nothing where it is not usable.
std::vector<double> errors_by_fit(const std::string& arm, const KinematicsResult& fit,
                                  std::span<const ArmPosture> postures, FitReport& report) {
  if (!fit.fit.usable()) {
    report = {.status = FitStatus::Degenerate, .message = arm + " cannot be placed: " + fit.fit.message};
    return {};
  }
  if (fit.fit.status == FitStatus::MaxIterations) report.status = fit.fit.status;
  report.iterations = std::max(report.iterations, fit.fit.iterations);
  return place_errors(fit, postures);
}

Eigen::Map<const Eigen::VectorXd> as_vector_of(const std::vector<double>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

/// Both arms placed on the further postures.
void compare_placed(const KinematicsResult& result, const kinematics::DhChain& nominal,
                    std::span<const ArmPosture> further, const KinematicsOptions& options, FurtherPostures& out) {
  require(further.size() >= min_postures_to_place,
          "further: found " + std::to_string(further.size()) + " postures, expected at least " +
              std::to_string(min_postures_to_place) + " to place device and measured point on them");
  const KinematicsOptions held = arm_held(options, {});
  const std::vector<ArmPosture> stood = as_they_stood(result, further);
  out.errors = errors_by_fit("the identified arm", calibrate_kinematics(result.arm, stood, {}, held), stood, out.fit);
  if (!out.fit.usable()) return;
  out.nominal_errors =
      errors_by_fit("the nominal arm", calibrate_kinematics(nominal, further, {}, held), further, out.fit);
}

/// The identified arm as it was fitted, the nominal one placed on the same postures.
void compare_fitted(const KinematicsResult& result, const kinematics::DhChain& nominal,
                    std::span<const ArmPosture> fitted, std::span<const ArmPosture> further,
                    std::span<const SocketDistance> distances, const KinematicsOptions& options, FurtherPostures& out) {
  out.errors = place_errors(result, further);
  const KinematicsOptions held = arm_held(options, held_beside_arm(options.hold));
  const KinematicsResult as_nominal = calibrate_kinematics(nominal, sound_postures_of(result, fitted), distances, held);
  out.nominal_errors = errors_by_fit("the nominal arm", as_nominal, further, out.fit);
}

}  // namespace

bool need_placing(std::span<const ArmPosture> fitted, std::span<const ArmPosture> further) {
  return std::any_of(further.begin(), further.end(), [&](const ArmPosture& one) {
    const int kind = kind_of_place(one);
    return kind < 0 || std::none_of(fitted.begin(), fitted.end(),
                                    [&](const ArmPosture& other) { return kind_of_place(other) == kind; });
  });
}

FurtherPostures evaluate_arm(const KinematicsResult& result, const kinematics::DhChain& nominal,
                             std::span<const ArmPosture> fitted, std::span<const ArmPosture> further,
                             std::span<const SocketDistance> distances, const KinematicsOptions& options) {
  require(result.fit.usable(), "the result is not usable: " + result.fit.message);
  require(!further.empty(), "there are no further postures");
  FurtherPostures out;
  out.placed = need_placing(fitted, further);
  out.fit = {.status = FitStatus::Converged, .message = std::to_string(further.size()) + " further postures"};
  if (out.placed)
    compare_placed(result, nominal, further, options, out);
  else
    compare_fitted(result, nominal, fitted, further, distances, options, out);
  if (!out.fit.usable()) {
    out.errors.clear(), out.nominal_errors.clear();
    return out;
  }
  const auto errors = as_vector_of(out.errors);
  out.mean = errors.mean();
  out.rms = std::sqrt(errors.squaredNorm() / static_cast<double>(errors.size()));
  out.max = errors.maxCoeff();
  out.nominal_mean = as_vector_of(out.nominal_errors).mean();
  return out;
}

}  // namespace kr5::calibration
