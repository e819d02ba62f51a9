// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/second_order.hpp>

#include <cmath>

#include <kr5/physics/cubic_spline.hpp>
#include <kr5/robot/servo_feedforward.hpp>

namespace kr5::physics {

using Eigen::Index;
using Eigen::Vector2d;

Eigen::Matrix2d transition(const cell::SecondOrder& servo, double h) {
  const double w = servo.natural_frequency, decay = servo.damping_ratio * w;
  const double split = 1.0 - servo.damping_ratio * servo.damping_ratio, s = w * std::sqrt(std::abs(split));
  double c, d;  // cos(s h) and sin(s h) / s, or their hyperbolic likes, times the decay
  if (s * h < 1e-6) {
    c = std::exp(-decay * h), d = h * c;
  } else if (split > 0) {
    const double e = std::exp(-decay * h);
    c = e * std::cos(s * h), d = e * std::sin(s * h) / s;
  } else {
    const double slow = std::exp((s - decay) * h), fast = std::exp(-(s + decay) * h);
    c = (slow + fast) / 2, d = (slow - fast) / (2 * s);
  }
  Eigen::Matrix2d A;
  A << c + decay * d, d, -w * w * d, c - decay * d;
  return A;
}

Eigen::Vector4d steady_response(const cell::SecondOrder& servo, const Eigen::Vector4d& c) {
  const robot::ServoFeedforward lead(servo.natural_frequency, servo.damping_ratio);
  Eigen::Vector4d p;
  p[3] = c[3];
  p[2] = c[2] - lead(3 * p[3], 0.0);  // c = p + lead(p', p''), power by power
  p[1] = c[1] - lead(2 * p[2], 6 * p[3]);
  p[0] = c[0] - lead(p[1], 2 * p[2]);
  return p;
}

namespace {

/// Value and slope of a cubic.
Vector2d at(const Eigen::Vector4d& p, double s) {
  return {p[0] + s * (p[1] + s * (p[2] + s * p[3])), p[1] + s * (2 * p[2] + s * 3 * p[3])};
}

/// The transition of the last duration asked for, which is nearly always the next one too.
class Transition {
 public:
  explicit Transition(const cell::SecondOrder& servo) : servo_(servo) {}
  const Eigen::Matrix2d& operator()(double h) {
    if (std::abs(h - h_) > 1e-12) A_ = transition(servo_, h_ = h);
    return A_;
  }

 private:
  const cell::SecondOrder& servo_;
  double h_ = 0.0;
  Eigen::Matrix2d A_ = Eigen::Matrix2d::Identity();
};

/// Response to a command that is a cubic between the rows, and `first` before them.
Eigen::Matrix<double, Eigen::Dynamic, 3> follow(const cell::SecondOrder& servo,
                                                const Eigen::Ref<const Eigen::VectorXd>& t, double first,
                                                const SplinePieces& pieces) {
  const Index n = t.size();
  Eigen::Matrix<double, Eigen::Dynamic, 3> out(n, 3);
  Transition whole(servo), part(servo);
  // Piece k of the delayed command begins at t[k] + delay; piece -1, before the first, is the first command held.
  Index piece = -1;
  Eigen::Vector4d c(first, 0, 0, 0), p = c;
  Vector2d rest(0, 0);  // at the beginning of the piece, less the steady cubic
  double begin = t[0];
  for (Index row = 0; row < n; ++row) {
    while (piece + 1 < n - 1 && t[piece + 1] + servo.delay <= t[row] + 1e-9) {
      const double end = t[piece + 1] + servo.delay;
      const Vector2d state = at(p, end - begin) + whole(end - begin) * rest;
      c = pieces.row(++piece).transpose();
      p = steady_response(servo, c);
      rest = state - at(p, 0.0);
      begin = end;
    }
    const double s = t[row] - begin;
    const Vector2d state = at(p, s) + part(s) * rest;
    out(row, 0) = state[0];
    out(row, 1) = state[1];
    out(row, 2) = servo_acceleration(servo, at(c, s)[0], state[0], state[1]);
  }
  return out;
}

}  // namespace

Eigen::Matrix<double, Eigen::Dynamic, 3> follow_smooth(const cell::SecondOrder& servo,
                                                       const Eigen::Ref<const Eigen::VectorXd>& t,
                                                       const Eigen::Ref<const Eigen::VectorXd>& command) {
  return follow(servo, t, command[0], cubic_spline(t, command));
}

Eigen::Matrix<double, Eigen::Dynamic, 3> follow_held(const cell::SecondOrder& servo,
                                                     const Eigen::Ref<const Eigen::VectorXd>& t,
                                                     const Eigen::Ref<const Eigen::VectorXd>& command) {
  SplinePieces pieces = SplinePieces::Zero(command.size(), 4);
  pieces.col(0) = command;
  return follow(servo, t, command[0], pieces);
}

}  // namespace kr5::physics
