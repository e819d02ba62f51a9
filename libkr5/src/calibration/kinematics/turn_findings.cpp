// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/turn_findings.hpp>

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/kinematics/axis_chain.hpp>

#include "calibration/kinematics/home_place.hpp"

namespace kr5::calibration {
namespace {

using Eigen::Vector3d;

constexpr double no_noise = 1e-9;        // of computed samples [m]
constexpr std::size_t min_compared = 3;  // turns of which one can be another than the others

/// Sample before which the places leave the course of those before the most: their radius and height about the axis.
std::optional<int> greatest_step(std::span<const JointSample> turn, const JointAxisResult& axis) {
  if (turn.size() < 4) return std::nullopt;
  const Pose to_axis = axis.T_world_axis.inverse();
  Eigen::Matrix2Xd course(2, static_cast<Eigen::Index>(turn.size()));
  for (std::size_t i = 0; i < turn.size(); ++i) {
    const Vector3d local = to_axis * measured_place(turn[i]);
    course.col(static_cast<Eigen::Index>(i)) << local.head<2>().norm(), local.z();
  }
  if (!course.allFinite()) return std::nullopt;
  Eigen::Index at = 0;
  (course.rightCols(course.cols() - 1) - course.leftCols(course.cols() - 1)).colwise().norm().maxCoeff(&at);
  return static_cast<int>(at) + 1;
}

std::vector<UnevenNoise> find_uneven_noise(std::span<const std::vector<JointSample>> turns,
                                           std::span<const JointAxisResult> axes, double min_ratio) {
  std::vector<UnevenNoise> out;
  if (axes.size() < min_compared) return out;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    std::vector<double> others;
    for (std::size_t i = 0; i < axes.size(); ++i)
      if (i != k) others.push_back(axes[i].sigma_position);
    const double sigma = axes[k].sigma_position, usual = midpoint_median(others);
    if (sigma >= min_ratio * std::max(usual, no_noise))
      out.push_back({static_cast<int>(k), sigma, usual, greatest_step(turns[k], axes[k])});
  }
  return out;
}

std::optional<ShiftedRows> find_shifted_rows(std::span<const std::vector<JointSample>> turns,
                                             std::span<const JointAxisResult> axes) {
  if (axes.size() < min_compared) return std::nullopt;
  for (const TurnEnd end : {TurnEnd::First, TurnEnd::Last}) {
    ShiftedRows out{end, {}};
    for (std::size_t k = 0; k < axes.size(); ++k)
      if (is_outlier(axes[k], end == TurnEnd::First ? 0 : turns[k].size() - 1))
        out.joints.push_back(static_cast<int>(k));
    if (out.joints.size() >= std::max(min_compared, axes.size() - 2)) return out;
  }
  return std::nullopt;
}

std::vector<HomeJump> find_home_jumps(std::span<const std::vector<JointSample>> turns,
                                      std::span<const JointAxisResult> axes, const Eigen::VectorXd& home,
                                      double min_jump) {
  std::vector<HomeJump> out;
  for (const std::vector<JointSample>& turn : turns)
    for (const JointSample& sample : turn)
      if (!sample.q) return out;
  std::optional<HomePlace> before;
  for (std::size_t k = 0; k < turns.size(); ++k) {
    const std::optional<HomePlace> now = place_at_home(turns[k], axes[k], home[static_cast<Eigen::Index>(k)]);
    if (now && before) {
      const double distance = (now->place - before->place).norm(),
                   std = std::max(std::hypot(now->std, before->std), no_noise);
      if (distance > min_jump * std) out.push_back({static_cast<int>(k), distance, std});
    }
    before = now;
  }
  return out;
}

std::optional<ImplausibleLength> find_implausible_length(const kinematics::DhChain& arm,
                                                         const TurnFindingOptions& options) {
  double length = 0.0;
  for (const kinematics::DhJoint& joint : arm.joints) length += std::abs(joint.a) + std::abs(joint.b);
  if (length >= options.min_length && length <= options.max_length) return std::nullopt;
  return ImplausibleLength{length, length > options.max_length};
}

std::optional<NominalMismatch> find_nominal_mismatch(const kinematics::DhChain& arm, const kinematics::DhChain& nominal,
                                                     const Eigen::VectorXd& home, double max_scale_difference) {
  NominalMismatch out{.nominal_joints = static_cast<int>(nominal.joints.size())};
  if (nominal.joints.size() != arm.joints.size()) return out;
  const kinematics::DhChain believed =
      kinematics::chain_from_axes(kinematics::axes_of(nominal, home), home, nominal.flange(home));
  double product = 0.0, square = 0.0, found_square = 0.0;
  const auto compare = [&](double found, double expected) {
    product += found * expected, square += expected * expected, found_square += found * found;
  };
  for (std::size_t k = 0; k + 1 < arm.joints.size(); ++k) {
    // The sign of what lies between parallel axes tells nothing.
    if (kinematics::has_near_parallel_axes(believed.joints[k])) continue;
    compare(arm.joints[k].a, believed.joints[k].a);
    if (k > 0) compare(arm.joints[k].b, believed.joints[k].b);
  }
  if (square == 0.0) return std::nullopt;
  out.scale = product / square;
  out.residual = std::sqrt(std::max(found_square / square - out.scale * out.scale, 0.0));
  out.kind = out.scale < 0 ? NominalMismatchKind::Mirrored : NominalMismatchKind::Scaled;
  const bool off = out.scale < 0 || std::abs(out.scale - 1) > std::max(max_scale_difference, 3 * out.residual);
  return off ? std::optional(out) : std::nullopt;
}

}  // namespace

void TurnFindingOptions::validate() const {
  require(min_noise_ratio > 1, "min_noise_ratio must be above 1 [-]");
  require(min_jump > 0, "min_jump must be positive [-]");
  require(min_length >= 0 && min_length < max_length, "min_length must lie between 0 and max_length [m]");
  require(max_scale_difference > 0, "max_scale_difference must be positive [-]");
}

TurnFindings find_in_turns(std::span<const std::vector<JointSample>> turns, std::span<const JointAxisResult> axes,
                           const kinematics::DhChain& arm, const Eigen::VectorXd& home,
                           const kinematics::DhChain* nominal, const TurnFindingOptions& options) {
  options.validate();
  const auto same = [&](std::size_t size) { return size == turns.size(); };
  require(same(axes.size()) && same(arm.joints.size()) && same(static_cast<std::size_t>(home.size())),
          "find_in_turns: turns, axes, joints of the arm and joint values at home must be of one number");
  TurnFindings out;
  out.shifted_rows = find_shifted_rows(turns, axes);
  out.uneven_noise = find_uneven_noise(turns, axes, options.min_noise_ratio);
  out.home_jumps = find_home_jumps(turns, axes, home, options.min_jump);
  out.implausible_length = find_implausible_length(arm, options);
  if (nominal) out.nominal_mismatch = find_nominal_mismatch(arm, *nominal, home, options.max_scale_difference);
  return out;
}

}  // namespace kr5::calibration
