// SPDX-License-Identifier: BSD-3-Clause
#include "vision/camera_calibration/camera_start.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <kr5/core/linear.hpp>

namespace kr5::vision::detail {
namespace {

/// A view as the start sees it: in its own plane, or in space.
struct ViewGeometry {
  bool flat = false;
  Eigen::Vector3d centre;
  Eigen::Matrix3d basis;       ///< Columns by falling spread; the last is the normal of a flat target.
  Eigen::Matrix3d homography;  ///< Plane to pixels; flat only.
  double misfit = 0.0;         ///< RMS error of the homography over the spread of the pixels [-].
};

/// Centre and scale that make a cloud of points well conditioned.
template <int N>
Eigen::Matrix<double, N + 1, N + 1> conditioner(const Eigen::Matrix<double, N, Eigen::Dynamic>& x) {
  const Eigen::Matrix<double, N, 1> c = x.rowwise().mean();
  const double size = std::sqrt((x.colwise() - c).colwise().squaredNorm().mean() / N);
  Eigen::Matrix<double, N + 1, N + 1> T = Eigen::Matrix<double, N + 1, N + 1>::Identity();
  T.diagonal().template head<N>().setConstant(1 / size);
  T.template topRightCorner<N, 1>() = -c / size;
  return T;
}

/// Direct linear transform: the 3 x (N+1) matrix that takes points to pixels.
template <int N>
Eigen::Matrix<double, 3, N + 1> direct_linear(const Eigen::Matrix<double, N, Eigen::Dynamic>& points,
                                              const Eigen::Matrix2Xd& pixels) {
  constexpr int M = N + 1;
  const auto T = conditioner<N>(points);
  const auto U = conditioner<2>(pixels);
  Eigen::Matrix<double, 3 * M, 3 * M> A = Eigen::Matrix<double, 3 * M, 3 * M>::Zero();
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Matrix<double, M, 1> p = T * points.col(i).homogeneous();
    const Eigen::Vector3d q = U * pixels.col(i).homogeneous();
    Eigen::Matrix<double, 2, 3 * M> row = Eigen::Matrix<double, 2, 3 * M>::Zero();
    row.template block<1, M>(0, 0) = p.transpose();
    row.template block<1, M>(0, 2 * M) = -q.x() * p.transpose();
    row.template block<1, M>(1, M) = p.transpose();
    row.template block<1, M>(1, 2 * M) = -q.y() * p.transpose();
    A += row.transpose() * row;
  }
  const SymmetricEigen eigen = symmetric_eigen(A);
  const Eigen::Matrix<double, 3 * M, 1> h = eigen.vectors.col(0);
  Eigen::Matrix<double, 3, M> H;
  for (int k = 0; k < 3; ++k) H.row(k) = h.template segment<M>(k * M).transpose();
  return Eigen::Matrix3d(U.inverse()) * H * T;
}

Eigen::Matrix2Xd in_plane(const ViewGeometry& s, const View& view) {
  return (s.basis.transpose() * (view.points.colwise() - s.centre)).topRows<2>();
}

ViewGeometry view_geometry(const View& view) {
  const PointSpread spread = spread_of(view.points);
  ViewGeometry s{is_flat(spread), spread.centre, spread.basis, Eigen::Matrix3d::Identity(), 0.0};
  if (!s.flat) return s;
  const Eigen::Matrix2Xd plane = in_plane(s, view);
  s.homography = direct_linear<2>(plane, view.pixels);
  const Eigen::Matrix2Xd seen = (s.homography * plane.colwise().homogeneous()).colwise().hnormalized();
  const Eigen::Vector2d middle = view.pixels.rowwise().mean();
  s.misfit = std::sqrt((seen - view.pixels).squaredNorm() / (view.pixels.colwise() - middle).squaredNorm());
  return s;
}

/// Pose from M ~ [R t] up to scale and sign.
Pose pose_from(const Eigen::Matrix3d& M, const Eigen::Vector3d& t, double size) {
  const double sign = t.z() < 0 ? -1.0 : 1.0;
  Pose T = Pose::Identity();
  T.linear() = nearest_rotation(sign / size * M);
  T.translation() = sign / size * t;
  return T;
}

Pose pose_of(const ViewGeometry& s, const View& view, const Pinhole& c) {
  Pose plane_from_target = Pose::Identity();
  plane_from_target.linear() = s.basis.transpose();
  plane_from_target.translation() = -s.basis.transpose() * s.centre;
  Eigen::Matrix3d K_inverse;
  K_inverse << 1 / c.fx, 0, -c.cx / c.fx, 0, 1 / c.fy, -c.cy / c.fy, 0, 0, 1;
  if (s.flat) {
    const Eigen::Matrix3d H = K_inverse * s.homography;
    const double size = 0.5 * (H.col(0).norm() + H.col(1).norm()), sign = H(2, 2) < 0 ? -1.0 : 1.0;
    Eigen::Matrix3d M;
    M << H.col(0), H.col(1), sign / size * H.col(0).cross(H.col(1));
    return pose_from(M, H.col(2), size) * plane_from_target;
  }
  const Eigen::Matrix3Xd local = plane_from_target * view.points;
  const Eigen::Matrix2Xd rays = (K_inverse * view.pixels.colwise().homogeneous()).colwise().hnormalized();
  const Eigen::Matrix<double, 3, 4> P = direct_linear<3>(local, rays);
  return pose_from(P.leftCols<3>(), P.col(3), std::cbrt(std::abs(P.leftCols<3>().determinant()))) * plane_from_target;
}

double misfit(const View& view, const Pinhole& camera, const Pose& T) {
  double sum = 0;
  for (Eigen::Index i = 0; i < view.points.cols(); ++i) {
    const Eigen::Vector3d p = T * Eigen::Vector3d(view.points.col(i));
    if (!(p.z() > 1e-9)) return 1e6;
    sum += (camera.project(p) - view.pixels.col(i)).squaredNorm();
  }
  return std::sqrt(sum / double(view.points.cols()));
}

}  // namespace

CameraStart guess_camera(std::span<const View> views, int width, int height) {
  constexpr double near = 2.0;  // times the least misfit, up to which another focal length is a guess, too
  std::vector<ViewGeometry> geometries;
  CameraStart out;
  for (const View& v : views) {
    geometries.push_back(view_geometry(v));
    out.sound.push_back(geometries.back().misfit < 0.1);
  }
  Pinhole c{.width = width, .height = height};
  c.cx = 0.5 * (width - 1);
  c.cy = 0.5 * (height - 1);
  std::vector<std::pair<double, CameraState>> scan;
  for (double focal = 0.3 * width; focal < 12.0 * width; focal *= 1.15) {
    auto& [sum, state] = scan.emplace_back(0.0, CameraState{.camera = c, .poses = {}});
    state.camera.fx = state.camera.fy = focal;
    for (std::size_t i = 0; i < views.size(); ++i) {
      state.poses.push_back(pose_of(geometries[i], views[i], state.camera));
      if (out.sound[i]) sum += std::min(misfit(views[i], state.camera, state.poses[i]), 0.1 * width);
    }
    if (std::isnan(sum)) scan.pop_back();
  }
  std::vector<std::pair<double, CameraState>> minima;
  for (std::size_t k = 0; k < scan.size(); ++k)
    if ((k == 0 || scan[k].first < scan[k - 1].first) && (k + 1 == scan.size() || scan[k].first <= scan[k + 1].first))
      minima.push_back(scan[k]);
  std::stable_sort(minima.begin(), minima.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (auto& [sum, state] : minima)
    if (sum <= near * minima.front().first) out.states.push_back(std::move(state));
  if (!out.states.empty()) return out;
  c.fx = c.fy = width;
  out.states.push_back({.camera = c, .poses = std::vector<Pose>(views.size(), Pose::Identity())});
  return out;
}

}  // namespace kr5::vision::detail
