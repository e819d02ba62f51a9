// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye/model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

namespace kr5::calibration::hand_eye {
namespace {

/// d of M * to_pose(d) caused by a right perturbation of the robot pose.
Matrix6 by_robot(Mount mount, const Poses& poses, const Pose& M) {
  if (mount == Mount::EyeInHand) return -adjoint((poses.X * M).inverse());
  return adjoint(poses.Z.inverse());
}

/// exp(w + d) = exp(w) exp(J d): the right Jacobian of the rotation vector.
Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& w) {
  const double angle = w.norm(), squared = angle * angle;
  const Eigen::Matrix3d S = skew(w);
  if (angle < 1e-4) return Eigen::Matrix3d::Identity() - 0.5 * S + S * S / 6;
  return Eigen::Matrix3d::Identity() - (1 - std::cos(angle)) / squared * S +
         (angle - std::sin(angle)) / (squared * angle) * S * S;
}

/// Change of e when the robot pose T * to_pose(e) gets a further right perturbation.
Matrix6 by_perturbation(const Vector6& e) {
  Matrix6 G = Matrix6::Zero();
  G.topLeftCorner<3, 3>() = exp_rotation(e.tail<3>());
  G.bottomRightCorner<3, 3>() = right_jacobian(e.tail<3>()).inverse();
  return G;
}

}  // namespace

Pose predict(Mount mount, const Poses& poses, const Pose& T_base_flange) {
  const Pose T = mount == Mount::EyeInHand ? T_base_flange.inverse() : T_base_flange;
  return poses.X.inverse() * T * poses.Z;
}

Pose robot_pose(Mount mount, const Poses& poses, const Pose& M) {
  const Pose T = poses.Z * M.inverse() * poses.X.inverse();
  return mount == Mount::EyeInHand ? T : Pose(T.inverse());
}

std::optional<LinearView> linearise(Mount mount, const Poses& poses, const ObservedView& observed,
                                    const Pinhole& camera, const Vector6& e) {
  const Pose M = predict(mount, poses, observed.input->T_base_flange * to_pose(e));
  const View& view = observed.input->view;
  const Eigen::VectorXd& weights = observed.pose().weights;
  Matrix6 H = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  double squares = 0;
  for (int i = 0; i < view.points.cols(); ++i) {
    const Eigen::Vector3d p = M * view.points.col(i);
    if (!(p.z() > 1e-9)) return std::nullopt;
    Eigen::Matrix<double, 2, 3> P;
    const Eigen::Vector2d r = view.pixels.col(i) - camera.project(p, &P, nullptr);
    Eigen::Matrix<double, 2, 6> J;
    J.leftCols<3>() = P * M.linear();
    J.rightCols<3>() = -J.leftCols<3>() * skew(view.points.col(i));
    H += weights[i] * J.transpose() * J;
    g += weights[i] * J.transpose() * r;
    squares += weights[i] * r.squaredNorm();
  }
  const Matrix6 H_inverse = H.ldlt().solve(Matrix6::Identity());
  const Vector6 d = H_inverse * g;
  const Matrix6 to_error = by_perturbation(e) * by_robot(mount, poses, M).inverse();
  LinearView out;
  out.y = e + to_error * d;
  out.F << -to_error * adjoint(M.inverse()), to_error;
  out.U = observed.input->correlation * to_error * H_inverse * to_error.transpose();
  out.pixel_squares = std::max(squares - g.dot(d), 0.0);
  out.pixel_dof = 2.0 * weights.sum() - 6.0;
  if (!out.U.allFinite() || !out.y.allFinite()) return std::nullopt;
  return out;
}

double pixel_squares(Mount mount, const Poses& poses, const ObservedView& observed, const Pinhole& camera,
                     const Vector6& e) {
  const Pose M = predict(mount, poses, observed.input->T_base_flange * to_pose(e));
  const View& view = observed.input->view;
  double squares = 0;
  for (int i = 0; i < view.points.cols(); ++i) {
    const Eigen::Vector3d p = M * view.points.col(i);
    if (!(p.z() > 1e-9)) return std::numeric_limits<double>::infinity();
    squares += observed.pose().weights[i] * (view.pixels.col(i) - camera.project(p)).squaredNorm();
  }
  return squares;
}

}  // namespace kr5::calibration::hand_eye
