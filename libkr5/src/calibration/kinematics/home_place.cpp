// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/kinematics/home_place.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/kinematics/shifted_axis.hpp"

namespace kr5::calibration {

using Eigen::Vector3d;

Vector3d measured_place(const JointSample& sample) {
  if (sample.T_world_tool) return sample.T_world_tool->translation();
  if (sample.points.cols() > 0) return sample.points.col(0);
  return Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

bool is_outlier(const JointAxisResult& axis, std::size_t sample) {
  return std::find(axis.outliers.begin(), axis.outliers.end(), static_cast<int>(sample)) != axis.outliers.end();
}

std::optional<HomePlace> place_at_home(std::span<const JointSample> turn, const JointAxisResult& axis, double home) {
  const Pose to_axis = axis.T_world_axis.inverse();
  Eigen::Matrix3Xd back(3, static_cast<Eigen::Index>(turn.size()));  // turned about the axis until the joint is at home
  Eigen::Index count = 0;
  double reach = 0.0;
  for (std::size_t i = 0; i < turn.size(); ++i) {
    const Vector3d place = measured_place(turn[i]);
    if (is_outlier(axis, i) || !place.allFinite()) continue;
    const double angle = turn[i].q ? *turn[i].q - home : axis.angles[static_cast<Eigen::Index>(i)] - axis.angles[0];
    back.col(count++) = Eigen::AngleAxisd(-angle, Vector3d::UnitZ()) * (to_axis * place);
    reach = std::max(reach, std::abs(angle));
  }
  if (count == 0) return std::nullopt;
  const Vector3d mean = back.leftCols(count).rowwise().mean();
  const auto number = static_cast<double>(count);
  const double scatter = std::sqrt((back.leftCols(count).colwise() - mean).rowwise().squaredNorm().maxCoeff() / number);
  // The axis is known less well than the points that it is of; beside the arc that does not matter.
  const double spread = std::max(scatter, axis.sigma_position) / std::sqrt(std::max(1.0, number - 5)),
               tilt = tilt_std(axis) * mean.head<2>().norm() * std::max(1.0, axis.arc),
               offset = offset_std(axis) * std::min(1.0, reach);
  return HomePlace{axis.T_world_axis * mean, std::sqrt(spread * spread + tilt * tilt + offset * offset)};
}

}  // namespace kr5::calibration
