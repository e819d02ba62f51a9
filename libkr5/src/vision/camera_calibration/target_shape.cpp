// SPDX-License-Identifier: BSD-3-Clause
#include "vision/camera_calibration/target_shape.hpp"

#include <Eigen/Geometry>

#include <kr5/core/linear.hpp>

namespace kr5::vision::detail {

PointSpread spread_of(const Eigen::Matrix3Xd& points) {
  PointSpread out;
  out.centre = points.rowwise().mean();
  const Eigen::Matrix3Xd d = points.colwise() - out.centre;
  const SymmetricEigen eigen = symmetric_eigen(d * d.transpose());
  out.sizes = (eigen.values.reverse().cwiseMax(0.0) / double(points.cols())).cwiseSqrt();
  out.basis = eigen.vectors.rowwise().reverse();
  Eigen::Index largest = 0;  // the normal points the same way in every view of one target
  out.basis.col(2).cwiseAbs().maxCoeff(&largest);
  if (out.basis(largest, 2) < 0) out.basis.col(2) *= -1;
  out.basis.col(0) = out.basis.col(1).cross(out.basis.col(2));
  if (out.basis(2, 2) > 1 - 1e-9) out.basis.setIdentity();  // a board in its own plane: keep its axes
  return out;
}

bool is_flat(const PointSpread& s) { return s.sizes[2] < 1e-3 * s.sizes[0]; }

TargetPlane common_plane(std::span<const View> views) {
  Eigen::Index count = 0, at = 0;
  for (const View& v : views) count += v.points.cols();
  Eigen::Matrix3Xd all(3, count);
  for (const View& v : views) {
    all.middleCols(at, v.points.cols()) = v.points;
    at += v.points.cols();
  }
  const PointSpread spread = spread_of(all);
  const Eigen::Matrix3Xd local = spread.basis.transpose() * (all.colwise() - spread.centre);
  return {is_flat(spread), spread.centre, spread.basis, local.cwiseAbs().maxCoeff()};
}

Eigen::MatrixXd displacements(const TargetPlane& plane, const Eigen::Matrix3Xd& points) {
  Eigen::MatrixXd out(3 * points.cols(), shape_count);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d q = plane.basis.transpose() * (points.col(i) - plane.centre) / plane.half;
    const double x = q.x(), y = q.y();
    Eigen::Matrix<double, 3, shape_count> D;
    D << 0, 0, 0, x, y, 0, 0, 0, -y, x, x * x, x * y, y * y, 0, 0;
    out.middleRows<3>(3 * i) = plane.half * plane.basis * D;
  }
  return out;
}

Eigen::Matrix3Xd bent_points(const TargetPlane& plane, const Shape& shape, const Eigen::Matrix3Xd& points) {
  if (shape.isZero(0)) return points;
  return points + (displacements(plane, points) * shape).reshaped(3, points.cols());
}

}  // namespace kr5::vision::detail
