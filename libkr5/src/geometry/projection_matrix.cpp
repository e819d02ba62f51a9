// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/geometry/projection_matrix.hpp>

#include <cmath>
#include <string>

#include <Eigen/LU>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/core/random.hpp>

namespace kr5 {
namespace {

constexpr double off_plane = 1e-9;  ///< [m]
using Vector12 = Eigen::Matrix<double, 12, 1>;
using RowMajor34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

/// Moves the mean of points to the origin and their RMS distance to the root of their dimension.
template <int Dimension>
Eigen::Matrix<double, Dimension + 1, Dimension + 1> normaliser(
    const Eigen::Matrix<double, Dimension, Eigen::Dynamic>& points) {
  const Eigen::Matrix<double, Dimension, 1> mean = points.rowwise().mean();
  const double rms = std::sqrt((points.colwise() - mean).colwise().squaredNorm().mean());
  const double scale = std::sqrt(static_cast<double>(Dimension)) / rms;
  auto out = Eigen::Matrix<double, Dimension + 1, Dimension + 1>::Identity().eval();
  out.template topLeftCorner<Dimension, Dimension>() *= scale;
  out.template topRightCorner<Dimension, 1>() = -scale * mean;
  return out;
}

void check_points(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels) {
  require(points.cols() == pixels.cols(),
          "there are " + std::to_string(points.cols()) + " points and " + std::to_string(pixels.cols()) + " pixels");
  require(points.cols() >= 6, "a projection matrix needs six points, found " + std::to_string(points.cols()));
  require(points.allFinite() && pixels.allFinite(), "points and pixels must be finite");
  const Eigen::VectorXd spread = singular_values(points.colwise() - points.rowwise().mean().eval());
  require((pixels.colwise() - pixels.col(0)).cwiseAbs().maxCoeff() > 0, "all pixels are the same");
  require(spread[2] > 1e-6 * spread[0], "the points lie in one plane: a projection matrix needs points off it");
}

/// The linear system of a matrix, and its solution, in normalised coordinates.
struct Dlt {
  Eigen::Matrix4d from_points;
  Eigen::Matrix3d from_pixels;
  Eigen::MatrixXd A;                             ///< 2 n x 12.
  Eigen::Matrix4Xd homogeneous;                  ///< Normalised points.
  Eigen::Matrix<double, 12, 12> pseudo_inverse;  ///< Of A^T A, without the solution.
  RowMajor34 solution;

  Dlt(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels)
      : from_points(normaliser<3>(points)), from_pixels(normaliser<2>(pixels)) {
    const Eigen::Index n = points.cols();
    homogeneous = from_points * points.colwise().homogeneous();
    const Eigen::Matrix3Xd p = from_pixels * pixels.colwise().homogeneous();
    A.setZero(2 * n, 12);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::RowVector4d x = homogeneous.col(i).transpose();
      A.row(2 * i).head<4>() = A.row(2 * i + 1).segment<4>(4) = x;
      A.row(2 * i).tail<4>() = -p(0, i) * x;
      A.row(2 * i + 1).tail<4>() = -p(1, i) * x;
    }
    const SymmetricEigen eigen = symmetric_eigen(A.transpose() * A);
    require(
        eigen.values[1] > 1e-14 * eigen.values[11],
        "the points do not determine a projection matrix: all but one lie in one plane, or they lie on a curve with "
        "the camera");
    Eigen::Map<Vector12>(solution.data()) = eigen.vectors.col(0);
    const auto others = eigen.vectors.rightCols(11);
    pseudo_inverse = others * eigen.values.tail(11).cwiseInverse().asDiagonal() * others.transpose();
  }

  /// In pixels and metres, not scaled.
  ProjectionMatrix matrix(const RowMajor34& normalised) const {
    return from_pixels.inverse() * normalised * from_points;
  }

  /// Derivative of `matrix(solution)`, row by row, by the pixels (u and v of each point in turn), 12 x 2 n: a residual
  /// that is 0 leaves no part of the normalisation, which depends on the pixels, too.
  Eigen::MatrixXd by_pixels() const {
    const Eigen::VectorXd depth = (solution.row(2) * homogeneous).transpose();
    Eigen::MatrixXd weighted = A.transpose();
    for (Eigen::Index i = 0; i < depth.size(); ++i) weighted.middleCols(2 * i, 2) *= from_pixels(0, 0) * depth[i];
    const Eigen::MatrixXd normalised = pseudo_inverse * weighted;
    Eigen::MatrixXd out(12, normalised.cols());
    for (Eigen::Index c = 0; c < out.cols(); ++c) {
      const RowMajor34 change = matrix(Eigen::Map<const RowMajor34>(normalised.col(c).data()));
      out.col(c) = Eigen::Map<const Vector12>(change.data());
    }
    return out;
  }
};

/// Factor that makes lambda the depth, positive for the points.
double depth_scale(const ProjectionMatrix& M, const Eigen::Vector3d& seen) {
  return std::copysign(1 / M.row(2).head<3>().norm(), M.row(2).dot(seen.homogeneous()));
}

/// A plane as the points [x y 1] of coordinates on it: 4 x 3.
Eigen::Matrix<double, 4, 3> plane_coordinates(const Plane& plane) {
  require(std::abs(plane.normal.norm() - 1) < 1e-6, "plane: normal must be a unit vector");
  const Eigen::Vector3d x = plane.normal.unitOrthogonal(), y = plane.normal.cross(x);
  Eigen::Matrix<double, 4, 3> out;
  out << x, y, plane.distance * plane.normal, 0, 0, 1;
  return out;
}

Eigen::Matrix3d homography_to_plane(const ProjectionMatrix& M, const Eigen::Matrix<double, 4, 3>& plane) {
  const Eigen::Matrix3d H = M * plane;
  const Eigen::VectorXd values = singular_values(H);
  require(values[2] > 1e-14 * values[0], "the plane is seen edge on");
  return H.inverse();
}

/// Derivative of a point on the plane by the matrix (row by row) and by its pixel: 3 x 12 and 3 x 2.
struct BackProjectionJacobian {
  Eigen::Matrix<double, 3, 12> by_matrix;
  Eigen::Matrix<double, 3, 2> by_pixel;

  BackProjectionJacobian(const ProjectionMatrix& M, const Eigen::Vector2d& pixel, const Plane& plane) {
    const Eigen::Matrix<double, 4, 3> P = plane_coordinates(plane);
    const Eigen::Matrix3d inverse = homography_to_plane(M, P);
    const Eigen::Vector3d h = inverse * pixel.homogeneous();
    Eigen::Matrix<double, 2, 3> divide;
    divide << 1, 0, -h[0] / h[2], 0, 1, -h[1] / h[2];
    const Eigen::Matrix3d outer = P.topLeftCorner<3, 2>() * (divide / h[2]) * inverse;
    const Eigen::RowVector4d y = (P * h).transpose();
    for (int row = 0; row < 3; ++row) by_matrix.middleCols<4>(4 * row) = -outer.col(row) * y;
    by_pixel = outer.leftCols<2>();
  }
};

/// Eq. 3.56 with the correct order of its factors, all in one unit of length.
Eigen::Matrix3d approximate_covariance(const ProjectionMatrix& M, const Eigen::Vector3d& point, double sigma_matrix) {
  const SymmetricEigen eigen = symmetric_eigen(M.transpose() * M);
  const Eigen::Matrix4d inverse = eigen.vectors.rightCols(3) * eigen.values.tail(3).cwiseInverse().asDiagonal() *
                                  eigen.vectors.rightCols(3).transpose();
  return sigma_matrix * sigma_matrix * point.homogeneous().squaredNorm() * inverse.topLeftCorner<3, 3>();
}

void simulate_back_projection(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels, const Plane& plane,
                              const BackProjectionOptions& options, std::vector<BackProjectedCorner>& corners) {
  if (options.draws == 0) return;
  Random random(options.seed);
  for (int i = 0; i < options.draws; ++i) {
    const Eigen::VectorXd noise = random.normal_vector(2 * pixels.cols(), options.sigma_pixel);
    const Eigen::Matrix2Xd noisy = pixels + Eigen::Map<const Eigen::Matrix2Xd>(noise.data(), 2, pixels.cols());
    const Dlt dlt(points, noisy);
    const ProjectionMatrix M = dlt.matrix(dlt.solution);
    for (BackProjectedCorner& corner : corners) {
      const Eigen::Vector2d pixel = (options.noisy_pixel ? noisy : pixels).col(corner.index);
      const Eigen::Vector3d e = back_project(M, pixel, plane) - corner.point;
      corner.simulated += e * e.transpose() / options.draws;
      corner.simulated_mean += e / options.draws;
    }
  }
  for (BackProjectedCorner& corner : corners)
    corner.simulated -= corner.simulated_mean * corner.simulated_mean.transpose();
}

}  // namespace

void BackProjectionOptions::validate() const {
  require(sigma_pixel > 0 && std::isfinite(sigma_pixel), "sigma_pixel must be positive [px]");
  require(length_unit > 0 && std::isfinite(length_unit), "length_unit must be positive [m]");
  require(draws == 0 || draws >= 100, "draws must be 0 or at least 100");
}

ProjectionMatrix projection_matrix(const Pinhole& camera, const Pose& T_camera_grid) {
  Eigen::Matrix3d K;
  K << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
  return K * T_camera_grid.matrix().topRows<3>();
}

ProjectionMatrix estimate_projection_matrix(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels) {
  check_points(points, pixels);
  const Dlt dlt(points, pixels);
  const ProjectionMatrix M = dlt.matrix(dlt.solution);
  return depth_scale(M, points.rowwise().mean()) * M;
}

Eigen::Vector3d back_project(const ProjectionMatrix& M, const Eigen::Vector2d& pixel, const Plane& plane) {
  const Eigen::Matrix<double, 4, 3> P = plane_coordinates(plane);
  return (P * (homography_to_plane(M, P) * pixel.homogeneous())).hnormalized();
}

BackProjectionResult back_projection_uncertainty(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels,
                                                 const Plane& plane, const BackProjectionOptions& options) {
  options.validate();
  check_points(points, pixels);
  const Dlt dlt(points, pixels);
  const ProjectionMatrix unscaled = dlt.matrix(dlt.solution);
  const double scale = depth_scale(unscaled, points.rowwise().mean());
  BackProjectionResult out{.M = scale * unscaled, .sigma_matrix = 0, .corners = {}};
  Eigen::MatrixXd by_pixels = scale * dlt.by_pixels();
  // The scale itself depends on the third row, whose first three entries stay a unit vector.
  const RowMajor34 rows = out.M;
  const Eigen::RowVectorXd stretched = out.M.row(2).head<3>() * by_pixels.middleRows<3>(8);
  by_pixels -= Eigen::Map<const Vector12>(rows.data()) * stretched;
  const double unit = options.length_unit;
  ProjectionMatrix M_unit = out.M;  // its lambda is the depth in that unit, too
  M_unit.col(3) /= unit;
  double squares = by_pixels.squaredNorm();
  for (const int last : {3, 7, 11}) squares += (1 / (unit * unit) - 1) * by_pixels.row(last).squaredNorm();
  out.sigma_matrix = options.sigma_pixel * std::sqrt(squares / 12);
  for (int i = 0; i < points.cols(); ++i) {
    if (std::abs(plane.normal.dot(points.col(i)) - plane.distance) > off_plane) continue;
    const BackProjectionJacobian J(out.M, pixels.col(i), plane);
    Eigen::MatrixXd by_noise = J.by_matrix * by_pixels;
    if (options.noisy_pixel) by_noise.middleCols<2>(2 * i) += J.by_pixel;
    BackProjectedCorner corner{.index = i, .point = points.col(i)};
    corner.covariance = std::pow(options.sigma_pixel, 2) * by_noise * by_noise.transpose();
    corner.approximate = unit * unit * approximate_covariance(M_unit, points.col(i) / unit, out.sigma_matrix);
    out.corners.push_back(corner);
  }
  require(!out.corners.empty(), "no point lies on the plane");
  simulate_back_projection(points, pixels, plane, options, out.corners);
  return out;
}

}  // namespace kr5
