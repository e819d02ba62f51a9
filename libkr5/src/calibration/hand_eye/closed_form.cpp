// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye/closed_form.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include <kr5/core/linear.hpp>

namespace kr5::calibration {
namespace {

/// Rotations of X and Z in G X C = Z: the leading singular vectors of the sum of Kronecker products.
void rotations(std::span<const Pose> G, std::span<const Pose> C, ClosedForm& out) {
  Eigen::Matrix<double, 9, 9> K = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < G.size(); ++i)  // vec(Z) = (C^T kron G) vec(X), columns stacked
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) K.block<3, 3>(3 * c, 3 * r) += C[i].linear()(r, c) * G[i].linear();
  const Eigen::JacobiSVD<Eigen::Matrix<double, 9, 9>, Eigen::NoQRPreconditioner> svd(
      K, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d R_X = Eigen::Map<const Eigen::Matrix3d>(svd.matrixV().col(0).data());
  Eigen::Matrix3d R_Z = Eigen::Map<const Eigen::Matrix3d>(svd.matrixU().col(0).data());
  if (R_X.determinant() < 0) R_X = -R_X, R_Z = -R_Z;
  out.X.linear() = nearest_rotation(R_X);
  out.Z.linear() = nearest_rotation(R_Z);
}

}  // namespace

Eigen::Vector3d principal_turns(std::span<const Pose> poses) {
  const Pose mean = mean_pose(poses);
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (const Pose& T : poses) {
    const Eigen::Vector3d w = log_rotation(mean.linear().transpose() * T.linear());
    M += w * w.transpose() / static_cast<double>(poses.size());
  }
  return symmetric_eigen(M).values.reverse().cwiseMax(0.0).cwiseSqrt();
}

ClosedForm closed_form(std::span<const Pose> robot, std::span<const Pose> C, Mount mount, bool free_scale) {
  ClosedForm out;
  std::vector<Pose> G(robot.begin(), robot.end());
  if (mount == Mount::EyeToHand)
    for (Pose& T : G) T = T.inverse();
  rotations(G, C, out);
  // R_G t_X - t_Z + s R_G R_X t_C = -t_G; metres against numbers of order one keep the system well scaled.
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
  out.Z.translation() = x.segment<3>(3);
  if (free_scale) out.scale = std::max(std::abs(x[6]), 1e-6);
  return out;
}

}  // namespace kr5::calibration
