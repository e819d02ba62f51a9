// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/camera_agreement.hpp>

#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <kr5/core/error.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace kr5::calibration {

std::optional<CameraAgreement> camera_agreement(const KinematicsResult& found, const KinematicsOptions& stated,
                                                double false_alarm) {
  require(false_alarm > 0 && false_alarm < 1, "false_alarm must lie between 0 and 1 [-]");
  std::vector<Eigen::Index> rows;
  std::vector<double> offset;
  const auto compare = [&](const std::string& block, const std::optional<Pose>& T_stated, const Pose& T_found) {
    std::vector<Eigen::Index> own;
    for (std::size_t k = 0; k < found.coordinates.size(); ++k)
      if (found.coordinates[k].name.starts_with(block + ".")) own.push_back(static_cast<Eigen::Index>(k));
    if (!T_stated || own.size() != 6) return;
    const Vector6 d = pose_difference(T_found, *T_stated);
    rows.insert(rows.end(), own.begin(), own.end());
    offset.insert(offset.end(), d.data(), d.data() + 6);
  };
  compare("camera", stated.T_flange_camera, found.T_flange_camera);
  compare("target", stated.T_base_target, found.T_base_target);
  if (!found.fit.usable() || rows.empty()) return std::nullopt;
  const Eigen::VectorXd d = Eigen::Map<const Eigen::VectorXd>(offset.data(), static_cast<Eigen::Index>(offset.size()));
  const Eigen::MatrixXd C = found.covariance(rows, rows);
  CameraAgreement out;
  out.dof = static_cast<int>(rows.size());
  out.squared_distance = d.dot(C.ldlt().solve(d));
  out.limit = uncertainty::chi_square_quantile(1 - false_alarm, out.dof);
  out.believed = out.squared_distance < out.limit;
  return out;
}

}  // namespace kr5::calibration
