// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/pose_findings.hpp"

#include <kr5/core/statistics.hpp>

#include "rsi/wire_units.hpp"

namespace kr5::rsi {
namespace {

/// Distance between the pose that is told and the one of the axis values, times a factor [m].
double pose_distance(const ControllerState& state, const ReadObservations& read, double factor) {
  const robot::SensorModel& model = *read.options.model;
  const std::optional<ControllerAxes>& axes = read.layout.axes;
  const Eigen::VectorXd all = state.joints;
  const Eigen::VectorXd scaled = axes && factor != 1.0 ? axes->joints(factor * axes->axes(all)) : factor * all;
  const Eigen::VectorXd joints = scaled.head(static_cast<Eigen::Index>(model.arm.joints.size()));
  const Pose T_base_tool = model.arm.flange(joints) * model.T_flange_tool;
  return (T_base_tool.translation() - state.tool->translation()).norm();
}

}  // namespace

Findings pose_findings(const ReadObservations& read, bool& compared) {
  if (!read.options.model) return {};
  const robot::SensorModel& model = *read.options.model;
  std::vector<double> degrees, radians;
  for (const ReadTelegram& t : read.telegrams) {
    if (!t.complete || !t.state.tool || static_cast<std::size_t>(t.state.joints.size()) < model.arm.joints.size())
      continue;
    degrees.push_back(pose_distance(t.state, read, 1.0));
    radians.push_back(pose_distance(t.state, read, 1.0 / degree));
  }
  compared = !degrees.empty();
  const double distance = median(degrees), other = median(radians), tolerance = read.options.position_tolerance;
  if (!compared || distance <= tolerance) return {};
  return {{.kind = other <= tolerance ? LinkFindingKind::RadianAxes : LinkFindingKind::PoseMismatch,
           .count = degrees.size(),
           .of = degrees.size(),
           .distance = distance,
           .other_distance = other}};
}

}  // namespace kr5::rsi
