// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/servo_bank.hpp>

#include <kr5/physics/second_order.hpp>

namespace kr5::physics {

ServoBank::ServoBank(std::vector<cell::SecondOrder> axes, double step, CommandHold hold) : axes_(std::move(axes)) {
  for (const cell::SecondOrder& axis : axes_) {
    Step& s = steps_.emplace_back();
    s.A = transition(axis, step);
    const Eigen::Vector2d held = Eigen::Vector2d::UnitX() - s.A.col(0);  // of a command of 1 over the whole step
    if (hold == CommandHold::ZeroOrderHold) {
      s.from.setZero();
      s.to = held;
      continue;
    }
    const Eigen::Vector4d p = steady_response(axis, {0.0, 1.0 / step, 0.0, 0.0});  // of a command from 0 to 1
    s.to = Eigen::Vector2d(p[0] + 1.0, p[1]) - s.A * p.head<2>();
    s.from = held - s.to;
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
    out[i] = servo_acceleration(axes_[static_cast<std::size_t>(i)], u[i], x[i], v[i]);
  }
  return out;
}

}  // namespace kr5::physics
