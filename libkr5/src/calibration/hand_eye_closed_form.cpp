// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "hand_eye_evidence.hpp"

namespace kr5::calibration::evidence {
namespace {

/// Rotations of X and Y in G X C = Y: the leading singular vectors of the sum of Kronecker products.
void rotations(std::span<const Pose> G, std::span<const Pose> C, ClosedForm& out) {
  Eigen::Matrix<double, 9, 9> K = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < G.size(); ++i)  // vec(Y) = (C^T kron G) vec(X), columns stacked
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) K.block<3, 3>(3 * c, 3 * r) += C[i].linear()(r, c) * G[i].linear();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(K, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d R_X = Eigen::Map<const Eigen::Matrix3d>(svd.matrixV().col(0).data());
  Eigen::Matrix3d R_Y = Eigen::Map<const Eigen::Matrix3d>(svd.matrixU().col(0).data());
  if (R_X.determinant() < 0) R_X = -R_X, R_Y = -R_Y;
  out.X.linear() = nearest_rotation(R_X);
  out.Y.linear() = nearest_rotation(R_Y);
}

/// Squared error of a point at the distance of the target, averaged over directions.
double squared_error(const Vector6& r, double lever) {
  return r.head<3>().squaredNorm() + 2.0 / 3.0 * lever * lever * r.tail<3>().squaredNorm();
}

}  // namespace

ClosedForm closed_form(std::span<const Pose> robot, std::span<const Pose> C, Mount mount, bool free_scale) {
  ClosedForm out;
  std::vector<Pose> G(robot.begin(), robot.end());
  if (mount == Mount::EyeToHand)
    for (Pose& T : G) T = T.inverse();
  rotations(G, C, out);
  // R_G t_X - t_Y + s R_G R_X t_C = -t_G; metres against numbers of order one keep the system well scaled.
  const auto n = static_cast<Eigen::Index>(G.size());
  const int unknowns = free_scale ? 7 : 6;
  Eigen::MatrixXd A(3 * n, unknowns);
  Eigen::VectorXd b(3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Pose& g = G[static_cast<std::size_t>(i)];
    const Eigen::Vector3d seen = g.linear() * out.X.linear() * C[static_cast<std::size_t>(i)].translation();
    A.block<3, 3>(3 * i, 0) = g.linear();
    A.block<3, 3>(3 * i, 3) = -Eigen::Matrix3d::Identity();
    if (free_scale) A.block<3, 1>(3 * i, 6) = seen;
    b.segment<3>(3 * i) = -g.translation();
    if (!free_scale) b.segment<3>(3 * i) -= seen;
  }
  const Eigen::VectorXd x = A.completeOrthogonalDecomposition().solve(b);
  out.X.translation() = x.head<3>();
  out.Y.translation() = x.segment<3>(3);
  if (free_scale) out.scale = std::max(std::abs(x[6]), 1e-6);
  return out;
}

double misplaced(const Pose& T_base_flange, const Sighting& sighting, const Fit& f, Mount mount) {
  double least = 1e300;
  for (const auto& s : sighting.solutions) {
    Pose C = s.T_camera_target;
    C.translation() *= f.scale;
    least = std::min(least, squared_error(residual(T_base_flange, C, f.X, f.Y, mount), C.translation().norm()));
  }
  return least;
}

double held_out_rms(const Reading& reading, const Sightings& sightings, int folds) {
  const int n = reading.size();
  folds = std::min(folds, n);
  double sum = 0;
  int count = 0;
  for (int fold = 0; fold < folds; ++fold) {
    Reading kept = reading;
    kept.robot.clear(), kept.sighting.clear(), kept.drift.clear(), kept.inflation.clear(), kept.split = 0;
    std::vector<int> left;
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (i % folds == fold) {
        if (reading.inflation.empty() || reading.inflation[k] == 1.0) left.push_back(i);
        continue;
      }
      kept.robot.push_back(reading.robot[k]);
      kept.sighting.push_back(reading.sighting[k]);
      if (!reading.drift.empty()) kept.drift.push_back(reading.drift[k]);
      if (!reading.inflation.empty()) kept.inflation.push_back(reading.inflation[k]);
      if (i < reading.split) ++kept.split;
    }
    const Fit f = fit(kept, sightings);
    if (!f.usable) continue;
    for (const int i : left) {
      const auto k = static_cast<std::size_t>(i);
      const Pose T = reading.drift.empty() ? reading.robot[k] : reading.robot[k] * to_pose(f.lag * reading.drift[k]);
      Fit there = f;
      if (reading.split > 0 && i >= reading.split) there.Y = f.Y_after;
      sum += misplaced(T, sightings.views[static_cast<std::size_t>(reading.sighting[k])], there, reading.mount);
      ++count;
    }
  }
  return count ? std::sqrt(sum / count) : 0.0;
}

}  // namespace kr5::calibration::evidence
