// SPDX-License-Identifier: BSD-3-Clause
#include "predict/deflection.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include <kr5/predict/spline.hpp>

namespace kr5::predict {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Substeps of this many radians of the fastest vibration: 0.3 % error of its period.
constexpr double step_angle = 0.2;
constexpr int most_substeps = 64;
/// A spring that touches within the step may let another one go: solved again, at most so often.
constexpr int most_passes = 4;
/// A load below this is what rounding leaves of none: the link starts in the middle of its play [N m or N].
constexpr double no_load = 1e-6;

/// Size is 1 for one soft joint, which is the common case, or dynamic.
template <int Size>
class Integrator {
 public:
  using Vector = Eigen::Matrix<double, Size, 1>;
  using Matrix = Eigen::Matrix<double, Size, Size>;

  explicit Integrator(const std::vector<SoftJoint>& joints) {
    const auto m = static_cast<Index>(joints.size());
    k_.resize(m), half_.resize(m), zeta_.resize(m), d_.resize(m), x_.setZero(m), v_.setZero(m), a_.setZero(m);
    for (Index i = 0; i < m; ++i) {
      const SoftJoint& j = joints[static_cast<std::size_t>(i)];
      k_[i] = j.stiffness, half_[i] = j.gap / 2, zeta_[i] = j.damping;
    }
  }

  void start(const Vector& x, const Matrix& mass, const Vector& load) {
    x_ = x;
    set_mass(mass);
    const Vector force = -load - spring(x_);
    a_ = mass.llt().solve(force);
  }

  /// One row further; `load(s)` is the load s after its beginning.
  template <class Load>
  void advance(double dt, Load&& load, const Matrix& mass) {
    set_mass(mass);
    const int n = substeps(dt);
    const double h = dt / n;
    for (int i = 1; i <= n; ++i) step(h, load(i * h));
  }

  const Vector& x() const { return x_; }
  const Vector& v() const { return v_; }
  const Vector& a() const { return a_; }

 private:
  void set_mass(const Matrix& mass) {
    M_ = mass;
    d_ = 2 * zeta_.array() * (k_.array() * M_.diagonal().array()).sqrt();
  }

  int substeps(double dt) const {
    const double fastest = std::sqrt((k_.array() / M_.diagonal().array()).maxCoeff());
    return std::clamp(static_cast<int>(std::ceil(dt * fastest / step_angle)), 1, most_substeps);
  }

  Vector play(const Vector& x) const { return x.cwiseMin(half_).cwiseMax(-half_); }
  Vector spring(const Vector& x) const { return k_.cwiseProduct(x - play(x)); }

  /// Trapezoidal rule; which springs touch is guessed and mended.
  void step(double h, const Vector& load) {
    const Vector x1 = x_ + h * v_ + h * h / 4 * a_, v1 = v_ + h / 2 * a_;
    Vector touch = touching(x_ + h * v_), a = a_;
    for (int pass = 0; pass < most_passes; ++pass) {
      const Vector stiff = k_.cwiseProduct(touch.cwiseAbs());
      Matrix A = M_;
      A.diagonal() += h / 2 * d_ + h * h / 4 * stiff;
      const Vector force = -load - d_.cwiseProduct(v1) - stiff.cwiseProduct(x1 - touch.cwiseProduct(half_));
      a = A.llt().solve(force);
      const Vector now = touching(x1 + h * h / 4 * a);
      if (now == touch) break;
      touch = now;
    }
    x_ = x1 + h * h / 4 * a;
    v_ = v1 + h / 2 * a;
    a_ = a;
  }

  /// Side on which each spring touches: -1, 1, or 0 within the play; without play always one.
  Vector touching(const Vector& x) const {
    Vector out(x.size());
    for (Index i = 0; i < x.size(); ++i) out[i] = x[i] >= half_[i] ? 1.0 : (x[i] <= -half_[i] ? -1.0 : 0.0);
    return half_.maxCoeff() > 0 ? out : Vector(Vector::Ones(x.size()));
  }

  Vector k_, half_, zeta_, d_, x_, v_, a_;
  Matrix M_;
};

template <int Size>
Deflection solve(const std::vector<SoftJoint>& joints, const VectorXd& t, const MatrixXd& load,
                 const std::vector<MatrixXd>& mass) {
  const Index n = load.rows(), m = load.cols();
  Deflection out{MatrixXd(n, m), MatrixXd(n, m), MatrixXd(n, m)};
  VectorXd rest(m);  // in balance: on the side to which the load pushes, however light it is
  for (Index i = 0; i < m; ++i) {
    const SoftJoint& j = joints[static_cast<std::size_t>(i)];
    const double side = std::abs(load(0, i)) < no_load ? 0.0 : std::copysign(j.gap / 2, load(0, i));
    rest[i] = -load(0, i) / j.stiffness - side;
  }
  std::vector<Pieces> smooth;  // a load that is linear between rows of 12 ms would be off by several noises of a wrench
  for (Index i = 0; i < m; ++i) smooth.push_back(spline(t, load.col(i)));
  Integrator<Size> link(joints);
  link.start(rest, mass[0], load.row(0).transpose());
  for (Index row = 0; row < n; ++row) {
    if (row > 0) {
      const auto k = static_cast<std::size_t>(row);
      const auto between = [&](double s) {
        typename Integrator<Size>::Vector out(m);
        for (Index i = 0; i < m; ++i) {
          const auto c = smooth[static_cast<std::size_t>(i)].row(row - 1);
          out[i] = c[0] + s * (c[1] + s * (c[2] + s * c[3]));
        }
        return out;
      };
      link.advance(t[row] - t[row - 1], between, (mass[k - 1] + mass[k]) / 2);
    }
    out.x.row(row) = link.x().transpose();
    out.v.row(row) = link.v().transpose();
    out.a.row(row) = link.a().transpose();
  }
  return out;
}

}  // namespace

Deflection deflect(const std::vector<SoftJoint>& joints, const VectorXd& t, const MatrixXd& load,
                   const std::vector<MatrixXd>& mass) {
  return joints.size() == 1 ? solve<1>(joints, t, load, mass) : solve<Eigen::Dynamic>(joints, t, load, mass);
}

}  // namespace kr5::predict
