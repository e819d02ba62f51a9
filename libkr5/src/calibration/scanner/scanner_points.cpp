// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/scanner_points.hpp>

#include <cmath>
#include <string>

#include <Eigen/Dense>
#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/geometry/point_alignment.hpp>

namespace kr5::calibration {
namespace {

constexpr double min_spread = 1e-3;  // of points across a line, over their extent along it

Eigen::Matrix3Xd in_profile(const Eigen::Matrix2Xd& points) {
  Eigen::Matrix3Xd out = Eigen::Matrix3Xd::Zero(3, points.cols());
  out.row(0) = points.row(0);
  out.row(2) = points.row(1);
  return out;
}

/// Whether points span a plane: their second principal extent beside the first.
bool span_a_plane(const Eigen::Matrix3Xd& centred) {
  const Eigen::VectorXd extent = singular_values(centred);
  return extent[0] > 0 && extent[1] > min_spread * extent[0];
}

}  // namespace

ScannerFromPoints scanner_from_points(const Eigen::Matrix2Xd& points_scanner, const Eigen::Matrix3Xd& points_flange) {
  const Eigen::Index n = points_scanner.cols();
  require(n == points_flange.cols(), "found " + std::to_string(n) + " points in the scanner and " +
                                         std::to_string(points_flange.cols()) + " on the flange, expected as many");
  require(points_scanner.allFinite() && points_flange.allFinite(), "points must be finite");
  ScannerFromPoints out;
  if (n < 3) {
    out.fit.message = "found " + std::to_string(n) + " points, expected at least three that are not on one line";
    return out;
  }
  const Eigen::Matrix3Xd points = in_profile(points_scanner);
  if (!span_a_plane(points.colwise() - points.rowwise().mean().eval()) ||
      !span_a_plane(points_flange.colwise() - points_flange.rowwise().mean().eval())) {
    out.fit.message = "the points lie on one line: the turn of the scanner about it is not determined";
    return out;
  }
  out.T_flange_scanner = align_points(points, points_flange).T_to_from;
  double squares = 0.0;
  Matrix6 information = Matrix6::Zero();
  for (Eigen::Index k = 0; k < n; ++k) {
    squares += (out.T_flange_scanner * Eigen::Vector3d(points.col(k)) - points_flange.col(k)).squaredNorm();
    Eigen::Matrix<double, 3, 6> J;  // of R^T (T p) by a right perturbation
    J << Eigen::Matrix3d::Identity(), -skew(points.col(k));
    information += J.transpose() * J;
  }
  out.rms = std::sqrt(squares / static_cast<double>(n));
  out.covariance = squares / static_cast<double>(3 * n - 6) * information.ldlt().solve(Matrix6::Identity());
  out.fit = {FitStatus::Converged, 1, 0.0, 0.0, "pose from " + std::to_string(n) + " points"};
  return out;
}

Eigen::Matrix3d hayat2022_scanner_rotation(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2,
                                           const Eigen::Vector3d& x3, bool tip_is_nearer) {
  Eigen::Matrix3Xd centred(3, 3);
  centred << x1, x2, x3;
  require(centred.allFinite(), "points must be finite");
  centred.colwise() -= Eigen::Vector3d(centred.rowwise().mean());
  require(span_a_plane(centred), "the three points lie on one line");
  const Eigen::Vector3d r_x = (x1 - x2).normalized();                             // 2.1
  const Eigen::Vector3d r_xz = (tip_is_nearer ? x1 - x3 : x3 - x1).normalized();  // 2.2
  const Eigen::Vector3d r_y = r_xz.cross(r_x).normalized();                       // 2.3
  Eigen::Matrix3d out;
  out << r_x, r_y, r_x.cross(r_y);  // 2.4, 2.5
  return out;
}

UncertainPose camera_scanner(const UncertainPose& T_flange_camera, const UncertainPose& T_flange_scanner,
                             const Matrix6& cross) {
  Eigen::MatrixXd joint(12, 12);
  joint << T_flange_camera.covariance, cross, cross.transpose(), T_flange_scanner.covariance;
  require(is_covariance(joint), "camera_scanner: the covariances of camera and scanner, and between them, are none");
  UncertainPose out;
  out.T = T_flange_camera.T.inverse() * T_flange_scanner.T;
  // (A exp(a))^-1 B exp(b) = A^-1 B exp(b - Ad(B^-1 A) a)
  const Matrix6 by_camera = -adjoint(out.T.inverse());
  out.covariance = by_camera * T_flange_camera.covariance * by_camera.transpose() + T_flange_scanner.covariance +
                   by_camera * cross + cross.transpose() * by_camera.transpose();
  return out;
}

}  // namespace kr5::calibration
