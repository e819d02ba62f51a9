// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/postures/row_order.hpp"

#include <algorithm>

#include "calibration/best_assignment.hpp"
#include "calibration/postures/device_fit.hpp"

namespace kr5::calibration {
namespace {

constexpr int order_rounds = 20;        // of device and order in turn
constexpr double clipped_at = 3.0;      // median column_distances beyond which one place is as far off as another
constexpr double clipped_margin = 0.1;  // and so much more [m]

/// Distance of each column of one matrix (row) from each of another (column).
Eigen::MatrixXd column_distances(const Eigen::MatrixXd& one, const Eigen::MatrixXd& other) {
  Eigen::MatrixXd out(one.cols(), other.cols());
  for (Eigen::Index k = 0; k < other.cols(); ++k)
    out.col(k) = (one.colwise() - other.col(k)).colwise().norm().transpose();
  return out;
}

/// Distances of each point from all, a column a point, in ascending order.
Eigen::MatrixXd sorted_distances(const Eigen::Matrix3Xd& points) {
  Eigen::MatrixXd out = column_distances(points, points);
  for (auto column : out.colwise()) std::sort(column.begin(), column.end());
  return out;
}

std::vector<Pose> flanges_in_order(const std::vector<Pose>& flanges, const std::vector<int>& order) {
  std::vector<Pose> out;
  for (const int k : order) out.push_back(flanges[static_cast<std::size_t>(k)]);
  return out;
}

}  // namespace

RowOrder match_rows(const std::vector<Pose>& flanges, const Eigen::Matrix3Xd& places) {
  const Eigen::Matrix3Xd origins = tip_places(flanges, Eigen::Vector3d::Zero());
  RowOrder out{best_assignment(column_distances(sorted_distances(places), sorted_distances(origins))), 0.0};
  DeviceFit device = fit_device(flanges_in_order(flanges, out.posture), places);
  for (int round = 0; round < order_rounds; ++round) {
    const Eigen::MatrixXd cost = column_distances(device.places, tip_places(flanges, device.tip));
    const std::vector<int> again = best_assignment(cost.cwiseMin(clipped_at * device.misfit + clipped_margin));
    if (again == out.posture) break;
    out.posture = again;
    device = fit_device(flanges_in_order(flanges, again), places);
  }
  out.misfit = device.misfit;
  return out;
}

}  // namespace kr5::calibration
