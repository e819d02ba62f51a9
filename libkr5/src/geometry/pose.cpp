// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/geometry/pose.hpp>

#include <cmath>
#include <numbers>

#include <kr5/core/error.hpp>

namespace kr5 {

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d S;
  S << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return S;
}

Eigen::Matrix3d exp_rotation(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity() + skew(w);
  return Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

Eigen::Vector3d log_rotation(const Eigen::Matrix3d& R) {
  Eigen::Quaterniond q(R);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double s = q.vec().norm();
  // Half-angle by atan2 keeps full precision both near 0 and near pi; acos of the trace does not.
  return s < 1e-12 ? Eigen::Vector3d(2.0 * q.vec()) : Eigen::Vector3d(2.0 * std::atan2(s, q.w()) / s * q.vec());
}

Pose to_pose(const Vector6& d) {
  Pose T = Pose::Identity();
  T.translation() = d.head<3>();
  T.linear() = exp_rotation(d.tail<3>());
  return T;
}

Vector6 to_vector(const Pose& T) {
  Vector6 d;
  d << T.translation(), log_rotation(T.linear());
  return d;
}

Vector6 pose_difference(const Pose& T_a, const Pose& T_b) { return to_vector(T_a.inverse() * T_b); }

Matrix6 adjoint(const Pose& T) {
  Matrix6 A = Matrix6::Zero();
  A.topLeftCorner<3, 3>() = T.linear();
  A.bottomRightCorner<3, 3>() = T.linear();
  A.topRightCorner<3, 3>() = skew(T.translation()) * T.linear();
  return A;
}

Pose from_xyzrpy(const Vector6& v) {
  Pose T = Pose::Identity();
  T.translation() = v.head<3>();
  T.linear() = (Eigen::AngleAxisd(v[5], Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(v[4], Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(v[3], Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  return T;
}

Vector6 to_xyzrpy(const Pose& T) {
  constexpr double at_pole = 1e-15, near_pole = 0.5;
  const Eigen::Matrix3d R = T.linear();
  const double horizontal = std::hypot(R(0, 0), R(1, 0));
  Vector6 v;
  v.head<3>() = T.translation();
  v[5] = horizontal > at_pole ? std::atan2(R(1, 0), R(0, 0)) : std::atan2(-R(0, 1), R(1, 1));
  if (horizontal > near_pole) {
    v[3] = std::atan2(R(2, 1), R(2, 2));
    v[4] = std::atan2(-R(2, 0), horizontal);
  } else {  // roll and yaw are badly known there, each alone; roll is what the yaw leaves
    const Eigen::Matrix3d turned = Eigen::AngleAxisd(-v[5], Eigen::Vector3d::UnitZ()).toRotationMatrix() * R;
    v[3] = horizontal > 0.0 ? std::atan2(-turned(1, 2), turned(1, 1)) : 0.0;
    v[4] = std::atan2(-turned(2, 0), turned(0, 0));
  }
  return v;
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& M) {
  const Eigen::JacobiSVD<Eigen::Matrix3d, Eigen::NoQRPreconditioner> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  signs[2] = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1.0 : 1.0;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

Eigen::Matrix3d rotation_from_z(const Eigen::Vector3d& direction) {
  return Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), direction).toRotationMatrix();
}

bool is_rotation(const Eigen::Matrix3d& R, double tolerance) {
  return R.allFinite() && (R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < tolerance && R.determinant() > 0;
}

Pose mean_pose(std::span<const Pose> poses) {
  require(!poses.empty(), "mean_pose: the list of poses is empty");
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  for (const Pose& T : poses) {
    sum += T.linear();
    translation += T.translation();
  }
  Pose mean = Pose::Identity();
  mean.linear() = nearest_rotation(sum);
  mean.translation() = translation / static_cast<double>(poses.size());
  return mean;
}

}  // namespace kr5
