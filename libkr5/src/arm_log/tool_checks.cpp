// SPDX-License-Identifier: BSD-3-Clause
#include "tool_checks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <kr5/core/statistics.hpp>
#include <kr5/geometry/point_alignment.hpp>

#include "joint_columns.hpp"

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;

namespace {

constexpr double off_share = 0.05, min_reach = 0.1;  // of the reach by which a tool may be off; of an arm [m]
constexpr double unit_factor = 1.6;                  // within which a spread is that of a wrong unit
constexpr double moved_share = 0.2;                  // of the distance that a rigid motion may leave

Matrix3Xd seen_tips(const cell::Experiment& experiment) {
  Matrix3Xd out(3, experiment.data.values.rows());
  int k = 0;
  for (const char* axis : {"x", "y", "z"}) out.row(k++) = experiment.data.column(axis).transpose();
  return out;
}

Matrix3Xd tips_of_cell(const cell::Cell& cell, const MatrixXd& q) {
  Matrix3Xd out(3, q.rows());
  for (Index i = 0; i < q.rows(); ++i) out.col(i) = cell::T_base_tool(cell, q.row(i).transpose()).translation();
  return out;
}

double median_norm(const Matrix3Xd& points) {
  const Eigen::VectorXd norms = points.colwise().norm();
  return midpoint_median({norms.begin(), norms.end()});
}

/// RMS distance of points from their mean.
double rms_spread(const Matrix3Xd& points) {
  return std::sqrt((points.colwise() - points.rowwise().mean().eval()).colwise().squaredNorm().mean());
}

/// The unit in which positions would spread as far as the cell's tool does.
LogRemedy unit_of_spread(double ratio) {
  for (const auto& [remedy, scale] : {std::pair{LogRemedy::PositionMillimetre, 1e3},
                                      {LogRemedy::PositionCentimetre, 1e2},
                                      {LogRemedy::PositionMetre, 1e-3}})
    if (ratio > scale / unit_factor && ratio < scale * unit_factor) return remedy;
  return LogRemedy::Check;
}

}  // namespace

std::vector<LogProblem> check_tool(const cell::Cell& cell, const cell::Experiment& experiment) {
  if (experiment.kind != cell::Kind::Poses || !has_column(experiment, "q1") || experiment.data.values.rows() == 0)
    return {};
  const Matrix3Xd seen = seen_tips(experiment),
                  tips = tips_of_cell(cell, joint_columns(experiment, "q", cell.robot.joints()));
  const double off = median_norm(seen - tips);
  if (off < off_share * std::max(median_norm(tips), min_reach)) return {};
  LogProblem out{.kind = LogProblemKind::ToolScale, .columns = {"x", "y", "z"}};
  out.found = rms_spread(seen) / std::max(rms_spread(tips), 1e-9);
  out.remedy = unit_of_spread(out.found);
  if (out.remedy != LogRemedy::Check) return {out};
  out.found = off;
  const Pose T_base_device = align_points(seen, tips).T_to_from;
  const Matrix3Xd moved = (T_base_device.linear() * seen).colwise() + T_base_device.translation();
  const double left = median_norm(moved - tips);
  out.kind = LogProblemKind::ToolElsewhere;
  if (!(left < moved_share * off)) return {out};
  out.kind = LogProblemKind::ToolFrame;
  out.remedy = LogRemedy::DeviceFrame;
  out.found_to = left;
  out.T_base_device = T_base_device;
  return {out};
}

}  // namespace kr5::arm_log
