// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/moved_device.hpp>

#include <algorithm>
#include <vector>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/postures/measured_place.hpp"

namespace kr5::calibration {
namespace {

using PlaceResiduals = Eigen::Array3Xd;

constexpr Eigen::Index min_tracked_places = 12, min_rows_beside = 4;  // in all, and before and after a jump
constexpr double outlier_limit = 6.0;  // standard deviations, at which outliers are cut off

Eigen::Array3d axis_medians(const PlaceResiduals& r) {
  Eigen::Array3d out;
  for (int k = 0; k < 3; ++k) out[k] = midpoint_median({r.row(k).begin(), r.row(k).end()});
  return out;
}

/// PlaceResiduals of which none is farther off than noise.
PlaceResiduals without_outliers(const PlaceResiduals& r) {
  const Eigen::Array3d middle = axis_medians(r);
  const PlaceResiduals off = r.colwise() - middle;
  const Eigen::Array3d limit = outlier_limit * (mad_to_sigma * axis_medians(off.abs())).max(1e-12);
  PlaceResiduals out = r;
  for (auto column : out.colwise()) column = column.max(middle - limit).min(middle + limit);
  return out;
}

/// The jump between the residuals before and after a row, and its variance per axis.
struct ResidualJump {
  Eigen::Array3d size, variance;

  ResidualJump(const PlaceResiduals& before, const PlaceResiduals& after) {
    const auto squares = [](const PlaceResiduals& r) -> Eigen::Array3d {
      return (r.colwise() - r.rowwise().mean().eval()).square().rowwise().sum();
    };
    const auto k = static_cast<double>(before.cols()), l = static_cast<double>(after.cols());
    size = after.rowwise().mean() - before.rowwise().mean();
    variance = ((squares(before) + squares(after)) / (k + l - 2) * (1 / k + 1 / l)).max(1e-24);
  }
  double chi_square() const { return (size.square() / variance).sum(); }
};

/// Where the calibrated arm puts the measured place of a posture.
Eigen::Vector3d predicted_place(const KinematicsResult& result, const ArmPosture& posture) {
  require(posture.T_world_tool || result.points.cols() > 0, "postures: the result has no measured point on the flange");
  const Eigen::VectorXd torques = result.compliances.size() > 0 ? posture.torques : Eigen::VectorXd();
  const Eigen::Vector3d tip =
      posture.T_world_tool ? Eigen::Vector3d(result.T_flange_tool.translation()) : result.points.col(0);
  return result.T_world_base * result.flange(posture.q, torques) * tip;
}

}  // namespace

std::optional<MovedDevice> find_moved_device(const KinematicsResult& result, std::span<const ArmPosture> postures,
                                             double max_chi_square) {
  require(max_chi_square > 0, "max_chi_square must be positive [-]");
  std::vector<int> rows;
  PlaceResiduals r(3, static_cast<Eigen::Index>(postures.size()));
  for (std::size_t i = 0; i < postures.size(); ++i) {
    check_joint_values(postures[i], i, result.arm.joints.size());
    const auto place = measured_place(postures[i]);
    if (!place) continue;
    r.col(static_cast<Eigen::Index>(rows.size())) = *place - predicted_place(result, postures[i]);
    rows.push_back(static_cast<int>(i));
  }
  const auto n = static_cast<Eigen::Index>(rows.size());
  r.conservativeResize(3, n);
  if (n < min_tracked_places) return std::nullopt;
  const PlaceResiduals noise = without_outliers(r);
  double greatest = 0.0;
  Eigen::Index at = 0;
  for (Eigen::Index k = min_rows_beside; k <= n - min_rows_beside; ++k) {
    const double chi_square = ResidualJump(noise.leftCols(k), noise.rightCols(n - k)).chi_square();
    if (chi_square > greatest) greatest = chi_square, at = k;
  }
  if (greatest < max_chi_square) return std::nullopt;
  const ResidualJump jump(without_outliers(r.leftCols(at)), without_outliers(r.rightCols(n - at)));
  const double inflation = uncertainty::covariance_inflation(1, static_cast<double>(n - 2));
  return MovedDevice{rows[static_cast<std::size_t>(at)], jump.size.matrix(),
                     (inflation * jump.variance).sqrt().matrix(), greatest};
}

}  // namespace kr5::calibration
