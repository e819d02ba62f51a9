// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/geometry/resection.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <kr5/core/error.hpp>
#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/core/statistics.hpp>

namespace kr5 {
namespace {

/// Squared distances of seen and predicted points, weighted by Huber's law.
class ReprojectionProblem {
 public:
  ReprojectionProblem(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels, const Pinhole& camera,
                      const ResectionOptions& options)
      : points_(points), pixels_(pixels), camera_(camera), options_(options), squared_(points.cols()) {}

  /// Infinite when a point lies behind the camera.
  double cost(const Pose& T) {
    for (Eigen::Index i = 0; i < points_.cols(); ++i) {
      const Eigen::Vector3d q = T * points_.col(i);
      if (!(q.z() > 1e-9)) return std::numeric_limits<double>::infinity();
      squared_[i] = (camera_.project(q) - pixels_.col(i)).squaredNorm();
    }
    return weights_.dot(squared_);
  }

  NormalEquations<6> equations(const Pose& T) const {
    NormalEquations<6> out;
    for (Eigen::Index i = 0; i < points_.cols(); ++i) {
      const Eigen::Vector3d point = points_.col(i);
      Eigen::Matrix<double, 2, 3> P;
      const Eigen::Vector2d r = camera_.project(T * point, &P, nullptr) - pixels_.col(i);
      Eigen::Matrix<double, 6, 2> J;
      J.topRows<3>() = (P * T.linear()).transpose();
      J.bottomRows<3>() = skew(point) * J.topRows<3>();
      for (int k = 0; k < 2; ++k) out.add(J.col(k), r[k], weights_[i]);
    }
    return out;
  }

  Pose moved(const Pose& T, const Vector6& step) const { return T * to_pose(step); }

  bool reweigh(const Pose&, const NormalEquations<6>&) {
    set_weights();
    return true;
  }

  /// The local optimum near a start; empty when the start puts points behind the camera.
  std::optional<Resection> refine(const Pose& start) {
    weights_.setOnes(points_.cols());
    if (!std::isfinite(cost(start))) return std::nullopt;
    set_weights();
    const auto found =
        levenberg_marquardt<6>(start, *this, {.max_iterations = options_.max_iterations, .min_sigma = rounding});
    if (found.status == LevenbergMarquardtStatus::NotFinite) return std::nullopt;
    Resection out;
    out.T_camera_points = found.x;
    out.T_camera_points.linear() = nearest_rotation(found.x.linear());
    if (!std::isfinite(cost(out.T_camera_points))) return std::nullopt;
    set_weights();
    out.information = equations(out.T_camera_points).information.selfadjointView<Eigen::Lower>();
    out.cost = weights_.dot(squared_);
    out.rms_px = std::sqrt(squared_.mean());
    out.weights = weights_;
    return out;
  }

 private:
  static constexpr double rounding = 1e-6;  // [px] what a fit to exact pixels may leave

  /// Huber weights against a scale that outlying points do not move. The median of a Rayleigh variable is 1.1774 sigma.
  void set_weights() {
    weights_.setOnes(squared_.size());
    if (options_.huber <= 0) return;
    // Six parameters have absorbed part of the noise.
    const double readings = 2.0 * static_cast<double>(squared_.size());
    const double shrink = std::sqrt(readings / std::max(readings - 6.0, 1.0));
    const double middle = median({squared_.data(), squared_.data() + squared_.size()});
    const double limit = options_.huber * std::max(std::sqrt(middle) / 1.1774 * shrink, rounding);
    for (Eigen::Index i = 0; i < squared_.size(); ++i)
      weights_[i] = std::min(1.0, limit / std::max(std::sqrt(squared_[i]), 1e-300));
  }

  const Eigen::Matrix3Xd& points_;
  const Eigen::Matrix2Xd& pixels_;
  const Pinhole& camera_;
  const ResectionOptions& options_;
  Eigen::VectorXd squared_, weights_;  ///< [px^2] at the last pose whose cost was asked for; [-]
};

/// Moves the origin to the mean and the mean distance to sqrt(dimension): without it the linear solution is noisy.
struct Normaliser {
  explicit Normaliser(const Eigen::MatrixXd& x) : mean(x.rowwise().mean()) {
    scale = std::sqrt(static_cast<double>(x.rows())) / (x.colwise() - mean).colwise().norm().mean();
  }
  Eigen::VectorXd operator()(const Eigen::VectorXd& x) const { return scale * (x - mean); }

  Eigen::VectorXd mean;
  double scale = 1.0;
};

/// Least-squares P, 3 x (D + 1), with (x, 1) ~ P (X, 1) for X of D rows: the direct linear transform.
Eigen::MatrixXd linear_transform(const Eigen::MatrixXd& X, const Eigen::Matrix2Xd& x) {
  const Normaliser points(X), image(x);
  const Eigen::Index D = X.rows(), n = D + 1;
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(3 * n, 3 * n);  // A' A, A h = 0 the two equations of every point
  for (Eigen::Index i = 0; i < X.cols(); ++i) {
    const Eigen::VectorXd h = points(X.col(i)).homogeneous(), y = image(x.col(i));
    for (Eigen::Index k = 0; k < 2; ++k) {
      Eigen::VectorXd row = Eigen::VectorXd::Zero(3 * n);
      row.segment(k * n, n) = h;
      row.tail(n) = -y[k] * h;
      M += row * row.transpose();
    }
  }
  const Eigen::VectorXd v = symmetric_eigen(M).vectors.col(0);
  Eigen::MatrixXd P = v.reshaped(n, 3).transpose();
  P.leftCols(D) *= points.scale;
  for (Eigen::Index k = 0; k < D; ++k) P.col(D) -= points.mean[k] * P.col(k);
  for (Eigen::Index k = 0; k < 2; ++k) P.row(k) = (P.row(k) / image.scale + image.mean[k] * P.row(2)).eval();
  return P;
}

Pose pose_from(const Eigen::Matrix3d& M, const Eigen::Vector3d& t) {
  Pose T = Pose::Identity();
  T.linear() = nearest_rotation(M);
  T.translation() = t;
  return T;
}

/// Start for points on the plane z = 0 of their own frame.
Pose planar_start(const Eigen::Matrix2Xd& plane, const Eigen::Matrix2Xd& rays) {
  Eigen::Matrix3d H = linear_transform(plane, rays);
  H /= std::sqrt(H.col(0).norm() * H.col(1).norm());
  if ((H * Eigen::Vector3d(plane.rowwise().mean().homogeneous())).z() < 0) H = -H;
  Eigen::Matrix3d M = H;
  M.col(2) = H.col(0).cross(H.col(1));
  return pose_from(M, H.col(2));
}

/// The other pose in which a plane looks almost the same: its depths mirrored along the line of sight.
Pose mirrored(const Pose& T, const Eigen::Vector3d& normal, const Eigen::Vector3d& middle) {
  const Eigen::Vector3d c = T * middle;
  const auto mirror = [](const Eigen::Vector3d& n) {
    return Eigen::Matrix3d(Eigen::Matrix3d::Identity() - 2 * n * n.transpose());
  };
  Pose out = Pose::Identity();
  out.linear() = mirror(c.normalized()) * T.linear() * mirror(normal);  // two mirrors make a rotation again
  out.translation() = c - out.linear() * middle;
  return out;
}

Pose spatial_start(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& rays) {
  Eigen::Matrix<double, 3, 4> P = linear_transform(points, rays);
  if (P.leftCols<3>().determinant() < 0) P = -P;
  P /= std::cbrt(P.leftCols<3>().determinant());
  return pose_from(P.leftCols<3>(), P.col(3));
}

/// Starts over the whole of the rotations (those of a cube into itself), for four or five points in space, where
/// nothing linear is determined.
std::vector<Pose> spread_starts(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& rays) {
  const Eigen::Vector3d middle = points.rowwise().mean();
  const Eigen::Vector2d seen = rays.rowwise().mean();
  const double distance = std::sqrt((points.colwise() - middle).squaredNorm() * 2 / 3 /
                                    std::max((rays.colwise() - seen).squaredNorm(), 1e-18));
  std::vector<Pose> starts;
  for (int face = 0; face < 6; ++face)
    for (int turn = 0; turn < 4; ++turn) {
      const Eigen::Vector3d ahead = Eigen::Vector3d::Unit(face % 3) * (face < 3 ? 1 : -1);
      const Eigen::Vector3d right = Eigen::Vector3d::Unit((face + 1 + turn % 2) % 3) * (turn < 2 ? 1 : -1);
      Pose T = Pose::Identity();
      T.linear() << right.transpose(), ahead.cross(right).transpose(), ahead.transpose();
      T.translation() = distance * seen.homogeneous() - T.linear() * middle;
      starts.push_back(T);
    }
  return starts;
}

std::optional<Eigen::Matrix2Xd> undistorted(const Eigen::Matrix2Xd& pixels, const Pinhole& camera) {
  Eigen::Matrix2Xd rays(2, pixels.cols());
  for (int i = 0; i < pixels.cols(); ++i) {
    const auto ray = camera.ray(pixels.col(i));
    if (!ray) return std::nullopt;
    rays.col(i) = ray->head<2>();
  }
  return rays;
}

/// How the points lie: their middle, their principal axes, and how far they reach along each, most first.
struct Axes {
  Pose T_points_axes = Pose::Identity();
  Eigen::Vector3d spread = Eigen::Vector3d::Zero();  ///< [m]
};

Axes principal_axes(const Eigen::Matrix3Xd& points) {
  Axes out;
  out.T_points_axes.translation() = points.rowwise().mean();
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (int i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d d = points.col(i) - out.T_points_axes.translation();
    M += d * d.transpose();
  }
  const SymmetricEigen eigen = symmetric_eigen(M);
  out.spread = eigen.values.reverse().cwiseMax(0.0).cwiseSqrt();
  out.T_points_axes.linear() = eigen.vectors.rowwise().reverse();
  if (out.T_points_axes.linear().determinant() < 0) out.T_points_axes.linear().col(2) *= -1;
  return out;
}

/// Keeps the better of optima that are the same pose; sorts the best to the front.
void add(std::vector<Resection>& found, const std::optional<Resection>& candidate) {
  if (!candidate) return;
  for (Resection& other : found)
    if (pose_difference(other.T_camera_points, candidate->T_camera_points).tail<3>().norm() < 1e-3) {
      if (candidate->cost < other.cost) other = *candidate;
      return;
    }
  const auto better = [](const Resection& a, const Resection& b) { return a.cost < b.cost; };
  found.insert(std::upper_bound(found.begin(), found.end(), *candidate, better), *candidate);
}

void check(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels, const ResectionOptions& options) {
  options.validate();
  require(points.cols() == pixels.cols(),
          "resect: " + std::to_string(points.cols()) + " points, but " + std::to_string(pixels.cols()) + " pixels");
  require(points.cols() >= 4, "resect: at least four points are needed, found " + std::to_string(points.cols()));
  require(points.allFinite() && pixels.allFinite(), "resect: points and pixels must be finite");
}

}  // namespace

void ResectionOptions::validate() const {
  require(max_iterations >= 1, "max_iterations must be at least 1");
  require(huber >= 0, "huber must not be negative [-]; 0 switches it off");
}

std::vector<Resection> resect(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels, const Pinhole& camera,
                              const ResectionOptions& options) {
  check(points, pixels, options);
  const auto rays = undistorted(pixels, camera);
  if (!rays) return {};
  const Axes axes = principal_axes(points);
  if (!(axes.spread[1] > 1e-6 * axes.spread[0])) return {};
  ReprojectionProblem problem(points, pixels, camera, options);
  std::vector<Resection> found;
  if (axes.spread[2] > 1e-4 * axes.spread[0]) {
    if (points.cols() >= 6) add(found, problem.refine(spatial_start(points, *rays)));
    // A cheap second opinion where the linear start is weak.
    if (points.cols() < 8 || found.empty())
      for (const Pose& start : spread_starts(points, *rays)) add(found, problem.refine(start));
    if (found.size() > 1) found.resize(1);
    return found;
  }
  const Pose T_plane_points = axes.T_points_axes.inverse();
  const Eigen::Matrix2Xd plane = (T_plane_points * points).topRows<2>();
  add(found, problem.refine(planar_start(plane, *rays) * T_plane_points));
  if (!found.empty()) {
    const Eigen::Vector3d normal = axes.T_points_axes.linear().col(2), middle = axes.T_points_axes.translation();
    add(found, problem.refine(mirrored(found.front().T_camera_points, normal, middle)));
  }
  return found;
}

}  // namespace kr5
