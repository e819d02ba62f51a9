// SPDX-License-Identifier: BSD-3-Clause
#include "servo.hpp"

#include <unsupported/Eigen/MatrixFunctions>

namespace kr5::sim {

ServoBank::ServoBank(std::vector<cell::SecondOrder> axes, double step, Between between) : axes_(std::move(axes)) {
  for (const cell::SecondOrder& axis : axes_) {
    const double w = axis.natural_frequency;
    // State, command and its slope in one autonomous system, whose exponential holds the exact step (Van Loan 1978).
    Eigen::Matrix4d system = Eigen::Matrix4d::Zero();
    system(0, 1) = 1.0;
    system.row(1) << -w * w, -2.0 * axis.damping_ratio * w, w * w, 0.0;
    system(2, 3) = 1.0;
    const Eigen::Matrix4d whole = (system * step).exp();
    Step& s = steps_.emplace_back();
    s.A = whole.topLeftCorner<2, 2>();
    const Eigen::Vector2d held = whole.block<2, 1>(0, 2), ramp = whole.block<2, 1>(0, 3) / step;
    s.from = between == Between::Line ? Eigen::Vector2d(held - ramp) : Eigen::Vector2d::Zero();
    s.to = between == Between::Line ? ramp : held;
  }
}

void ServoBank::reset(const Eigen::VectorXd& x) {
  x_ = u_ = x;
  v_ = Eigen::VectorXd::Zero(x.size());
}

void ServoBank::advance(const Eigen::VectorXd& u) {
  for (Eigen::Index i = 0; i < x_.size(); ++i) {
    const Step& s = steps_[static_cast<std::size_t>(i)];
    const Eigen::Vector2d next = s.A * Eigen::Vector2d(x_[i], v_[i]) + s.from * u_[i] + s.to * u[i];
    x_[i] = next[0];
    v_[i] = next[1];
  }
  u_ = u;
}

void ServoBank::set(const Eigen::VectorXd& x, const Eigen::VectorXd& v) {
  x_ = x;
  v_ = v;
}

Eigen::VectorXd ServoBank::demand(const Eigen::VectorXd& u, const Eigen::VectorXd& x, const Eigen::VectorXd& v) const {
  Eigen::VectorXd out(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const cell::SecondOrder& axis = axes_[static_cast<std::size_t>(i)];
    const double w = axis.natural_frequency;
    out[i] = w * w * (u[i] - x[i]) - 2.0 * axis.damping_ratio * w * v[i];
  }
  return out;
}

}  // namespace kr5::sim
