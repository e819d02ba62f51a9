// SPDX-License-Identifier: BSD-3-Clause
#include "predict/deflection.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include <kr5/physics/cubic_spline.hpp>

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

/// Size is 1 for one soft joint, which is the common case, or dynamic.
template <int Size>
class Integrator {
 public:
  using Vector = Eigen::Matrix<double, Size, 1>;
  using Matrix = Eigen::Matrix<double, Size, Size>;

  explicit Integrator(const std::vector<physics::GearSpring>& springs) : springs_(springs) {
    const auto m = static_cast<Index>(springs.size());
    k_.resize(m), d_.resize(m), x_.setZero(m), v_.setZero(m), a_.setZero(m);
    for (Index i = 0; i < m; ++i) k_[i] = gear(i).stiffness;
  }

  void start(const Vector& x, const Matrix& mass, const Vector& load) {
    x_ = x;
    set_mass(mass);
    const Vector force = -load - spring(touching(x_), x_);
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
    for (Index i = 0; i < d_.size(); ++i) d_[i] = gear(i).damping(M_(i, i));
  }

  int substeps(double dt) const {
    const double fastest = std::sqrt((k_.array() / M_.diagonal().array()).maxCoeff());
    return std::clamp(static_cast<int>(std::ceil(dt * fastest / step_angle)), 1, most_substeps);
  }

  const physics::GearSpring& gear(Index i) const { return springs_[static_cast<std::size_t>(i)]; }

  /// Torque of each spring while it touches on its side of `touch`.
  Vector spring(const Vector& touch, const Vector& x) const {
    Vector out(x.size());
    for (Index i = 0; i < x.size(); ++i) out[i] = k_[i] * gear(i).strain_on(touch[i], x[i]);
    return out;
  }

  /// Trapezoidal rule; which springs touch is guessed and mended.
  void step(double h, const Vector& load) {
    const Vector x1 = x_ + h * v_ + h * h / 4 * a_, v1 = v_ + h / 2 * a_;
    Vector touch = touching(x_ + h * v_), a = a_;
    for (int pass = 0; pass < most_passes; ++pass) {
      Matrix A = M_;
      for (Index i = 0; i < d_.size(); ++i) A(i, i) += h / 2 * d_[i] + h * h / 4 * gear(i).stiffness_on(touch[i]);
      const Vector force = -load - d_.cwiseProduct(v1) - spring(touch, x1);
      a = A.llt().solve(force);
      const Vector now = touching(x1 + h * h / 4 * a);
      if (now == touch) break;
      touch = now;
    }
    x_ = x1 + h * h / 4 * a;
    v_ = v1 + h / 2 * a;
    a_ = a;
  }

  /// Side on which each spring touches.
  Vector touching(const Vector& x) const {
    Vector out(x.size());
    for (Index i = 0; i < x.size(); ++i) out[i] = gear(i).touching_side(x[i]);
    return out;
  }

  const std::vector<physics::GearSpring>& springs_;
  Vector k_, d_, x_, v_, a_;
  Matrix M_;
};

physics::SplinePieces linear_pieces(const VectorXd& t, const VectorXd& y) {
  physics::SplinePieces out = physics::SplinePieces::Zero(std::max<Index>(t.size() - 1, 0), 4);
  for (Index k = 0; k < out.rows(); ++k) out.row(k).head<2>() << y[k], (y[k + 1] - y[k]) / (t[k + 1] - t[k]);
  return out;
}

template <int Size>
Deflection solve(const std::vector<physics::GearSpring>& springs, const VectorXd& t, const MatrixXd& load,
                 const std::vector<MatrixXd>& mass, LoadBetweenRows rule) {
  const Index n = load.rows(), m = load.cols();
  Deflection out{MatrixXd(n, m), MatrixXd(n, m), MatrixXd(n, m)};
  VectorXd rest(m);
  for (Index i = 0; i < m; ++i) rest[i] = -springs[static_cast<std::size_t>(i)].lead_in_balance(load(0, i));
  // Behind a servo, a load that is linear between rows of 12 ms would be off by several noises of a wrench; through
  // measured positions, a spline would be: it rings where the acceleration changes its slope.
  std::vector<physics::SplinePieces> pieces;
  for (Index i = 0; i < m; ++i)
    pieces.push_back(rule == LoadBetweenRows::Linear ? linear_pieces(t, load.col(i))
                                                     : physics::cubic_spline(t, load.col(i)));
  Integrator<Size> link(springs);
  link.start(rest, mass[0], load.row(0).transpose());
  for (Index row = 0; row < n; ++row) {
    if (row > 0) {
      const auto k = static_cast<std::size_t>(row);
      const auto between = [&](double s) {
        typename Integrator<Size>::Vector out(m);
        for (Index i = 0; i < m; ++i)
          out[i] = physics::spline_value(pieces[static_cast<std::size_t>(i)].row(row - 1), s);
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

Deflection deflect(const std::vector<physics::GearSpring>& springs, const VectorXd& t, const MatrixXd& load,
                   const std::vector<MatrixXd>& mass, LoadBetweenRows between) {
  return springs.size() == 1 ? solve<1>(springs, t, load, mass, between)
                             : solve<Eigen::Dynamic>(springs, t, load, mass, between);
}

}  // namespace kr5::predict
