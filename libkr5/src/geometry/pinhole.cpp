// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/geometry/pinhole.hpp>

#include <cmath>

#include <Eigen/LU>

#include <kr5/core/error.hpp>

namespace kr5 {
namespace {

using Matrix2 = Eigen::Matrix2d;

/// Distorted point on the plane z = 1, with its derivatives by the undistorted point and by k1 k2 p1 p2 k3 k4 k5 k6.
Eigen::Vector2d distort(const Pinhole& c, const Eigen::Vector2d& p, Matrix2* by_point,
                        Eigen::Matrix<double, 2, 8>* by_k) {
  const double x = p.x(), y = p.y(), r = x * x + y * y, r2 = r * r, r3 = r2 * r;
  const double n = 1 + c.k1 * r + c.k2 * r2 + c.k3 * r3, d = 1 + c.k4 * r + c.k5 * r2 + c.k6 * r3, g = n / d;
  if (by_point) {
    const double dn = c.k1 + 2 * c.k2 * r + 3 * c.k3 * r2, dd = c.k4 + 2 * c.k5 * r + 3 * c.k6 * r2;
    const double dg = 2 * (dn - g * dd) / d;  // dg/dx = dg * x
    (*by_point) << g + dg * x * x + 2 * c.p1 * y + 6 * c.p2 * x, dg * x * y + 2 * c.p1 * x + 2 * c.p2 * y,
        dg * x * y + 2 * c.p1 * x + 2 * c.p2 * y, g + dg * y * y + 6 * c.p1 * y + 2 * c.p2 * x;
  }
  if (by_k) {
    const double a = 1 / d, b = -g / d;
    (*by_k) << x * r * a, x * r2 * a, 2 * x * y, r + 2 * x * x, x * r3 * a, x * r * b, x * r2 * b, x * r3 * b,
        y * r * a, y * r2 * a, r + 2 * y * y, 2 * x * y, y * r3 * a, y * r * b, y * r2 * b, y * r3 * b;
  }
  return {x * g + 2 * c.p1 * x * y + c.p2 * (r + 2 * x * x), y * g + c.p1 * (r + 2 * y * y) + 2 * c.p2 * x * y};
}

}  // namespace

Pinhole::Parameters Pinhole::parameters() const {
  Parameters p;
  p << fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6;
  return p;
}

void Pinhole::set_parameters(const Parameters& p) {
  fx = p[0], fy = p[1], cx = p[2], cy = p[3];
  k1 = p[4], k2 = p[5], p1 = p[6], p2 = p[7], k3 = p[8], k4 = p[9], k5 = p[10], k6 = p[11];
}

bool Pinhole::covers(const Eigen::Vector3d& point) const {
  if (!(point.z() > 1e-9)) return false;
  const double r = point.head<2>().squaredNorm() / (point.z() * point.z());
  return r < 25.0 && 1 + r * (k4 + r * (k5 + r * k6)) > 0.05;
}

Eigen::Vector2d Pinhole::project(const Eigen::Vector3d& point) const { return project(point, nullptr, nullptr); }

Eigen::Vector2d Pinhole::project(const Eigen::Vector3d& point, Eigen::Matrix<double, 2, 3>* by_point,
                                 Eigen::Matrix<double, 2, parameter_count>* by_parameters) const {
  const double iz = 1.0 / point.z();
  const Eigen::Vector2d p = point.head<2>() * iz;
  Matrix2 D;
  Eigen::Matrix<double, 2, 8> K;
  const Eigen::Vector2d q = distort(*this, p, by_point ? &D : nullptr, by_parameters ? &K : nullptr);
  const Eigen::Vector2d f(fx, fy);
  if (by_point) {
    Eigen::Matrix<double, 2, 3> P;
    P << iz, 0, -p.x() * iz, 0, iz, -p.y() * iz;
    *by_point = f.asDiagonal() * D * P;
  }
  if (by_parameters) {
    by_parameters->setZero();
    (*by_parameters)(0, 0) = q.x();
    (*by_parameters)(1, 1) = q.y();
    (*by_parameters)(0, 2) = (*by_parameters)(1, 3) = 1.0;
    by_parameters->rightCols<8>() = f.asDiagonal() * K;
  }
  return f.cwiseProduct(q) + Eigen::Vector2d(cx, cy);
}

std::optional<Eigen::Vector3d> Pinhole::ray(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d target((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  if (!target.allFinite()) return std::nullopt;
  Eigen::Vector2d p = target;
  Matrix2 D;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector2d error = distort(*this, p, &D, nullptr) - target;
    if (!(D.determinant() > 1e-6)) return std::nullopt;  // beyond the fold of the polynomial: no unique answer
    Eigen::Vector2d step = D.inverse() * error;
    if (step.norm() > 0.3) step *= 0.3 / step.norm();
    p -= step;
    if (step.norm() < 1e-14 * (1 + p.norm())) break;
  }
  if (!((distort(*this, p, nullptr, nullptr) - target).norm() < 1e-9)) return std::nullopt;
  return Eigen::Vector3d(p.x(), p.y(), 1.0);
}

void Pinhole::validate() const {
  require(width > 0 && height > 0, "camera: width and height must be positive [px]");
  require(std::isfinite(fx) && fx > 0 && std::isfinite(fy) && fy > 0, "camera: fx and fy must be positive [px]");
  require(parameters().allFinite(), "camera: every parameter must be finite");
}

std::vector<int> lens_parameters(LensModel lens) {
  switch (lens) {
    case LensModel::None:
      return {};
    case LensModel::K1:
      return {4};
    case LensModel::K1K2:
      return {4, 5};
    case LensModel::Brown4:
      return {4, 5, 6, 7};
    case LensModel::Brown5:
      return {4, 5, 6, 7, 8};
    case LensModel::Radial6:
      return {4, 5, 8, 9, 10, 11};
    case LensModel::Rational8:
      return {4, 5, 6, 7, 8, 9, 10, 11};
  }
  throw InvalidArgument("lens: unknown model");
}

}  // namespace kr5
