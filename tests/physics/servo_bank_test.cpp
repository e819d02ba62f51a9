// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/servo_bank.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/physics/second_order.hpp>

namespace servo_bank_test {

using namespace kr5;
using namespace kr5::physics;
using Eigen::VectorXd;

namespace {

VectorXd one(double x) { return VectorXd::Constant(1, x); }

/// Runge-Kutta steps of the equation of motion itself, under a command u0 + rate t.
Eigen::Vector2d integrated(const cell::SecondOrder& servo, Eigen::Vector2d s, double u0, double rate, double time) {
  const int n = 20000;
  const double h = time / n;
  const auto f = [&](const Eigen::Vector2d& y, double t) {
    return Eigen::Vector2d(y[1], servo_acceleration(servo, u0 + rate * t, y[0], y[1]));
  };
  for (int i = 0; i < n; ++i) {
    const double t = i * h;
    const Eigen::Vector2d a = f(s, t), b = f(s + h / 2 * a, t + h / 2), c = f(s + h / 2 * b, t + h / 2),
                          d = f(s + h * c, t + h);
    s += h / 6 * (a + 2 * b + 2 * c + d);
  }
  return s;
}

}  // namespace

TEST_CASE("a step of a servo solves its equation of motion, under-, critically and overdamped, with both holds") {
  for (const double damping : {0.2, 0.85, 1.0, 1.0000001, 2.5}) {
    const cell::SecondOrder servo = {45.0, damping, 0.0};
    const double h = 0.03;
    const Eigen::Vector2d start(0.1, -2.0);
    for (const CommandHold hold : {CommandHold::ZeroOrderHold, CommandHold::FirstOrderHold}) {
      ServoBank bank({servo}, h, hold);
      bank.reset(one(0.3));
      bank.set(one(start[0]), one(start[1]));
      bank.advance(one(0.7));
      const bool ramp = hold == CommandHold::FirstOrderHold;
      const Eigen::Vector2d expected = integrated(servo, start, ramp ? 0.3 : 0.7, ramp ? (0.7 - 0.3) / h : 0.0, h);
      CAPTURE(damping, ramp);
      CHECK(bank.x()[0] == Approx(expected[0]).epsilon(1e-9));
      CHECK(bank.v()[0] == Approx(expected[1]).epsilon(1e-9));
      CHECK(bank.acceleration()[0] == Approx(servo_acceleration(servo, 0.7, expected[0], expected[1])).epsilon(1e-7));
    }
  }
}

TEST_CASE("many small steps come to where one large step comes") {
  const cell::SecondOrder servo = {30.0, 0.7, 0.0};
  ServoBank large({servo}, 0.04, CommandHold::ZeroOrderHold), small({servo}, 0.0001, CommandHold::ZeroOrderHold);
  large.reset(one(0.0)), small.reset(one(0.0));
  large.advance(one(1.0));
  for (int i = 0; i < 400; ++i) small.advance(one(1.0));
  CHECK(small.x()[0] == Approx(large.x()[0]).epsilon(1e-10));
  CHECK(small.v()[0] == Approx(large.v()[0]).epsilon(1e-10));
}

TEST_CASE("the response to a smooth command is that of small steps along it, late by the delay") {
  const cell::SecondOrder servo = {40.0, 0.8, 0.012};
  const VectorXd t = VectorXd::LinSpaced(151, 0.0, 1.8);
  const VectorXd command = 0.3 * (3.0 * t.array().square()).sin();  // starts at rest
  const auto smooth = follow_smooth(servo, t, command);
  const int per_row = 60;
  const double h = 0.012 / per_row;
  ServoBank bank({servo}, h, CommandHold::FirstOrderHold);
  bank.reset(one(0.0));
  double worst = 0.0;
  for (int k = 1; k < t.size(); ++k) {
    for (int i = 1; i <= per_row; ++i) {
      const double then = std::max(t[k - 1] + i * h - servo.delay, 0.0);
      bank.advance(one(0.3 * std::sin(3.0 * then * then)));
    }
    worst = std::max(worst, std::abs(bank.x()[0] - smooth(k, 0)));
  }
  CHECK(worst < 2e-5);  // the spline through rows of 12 ms of a command of up to 1.7 Hz
}

TEST_CASE("the response to a held command is that of its steps one after the other, at a delay of part of a cycle") {
  const cell::SecondOrder servo = {40.0, 0.8, 0.0175};
  const VectorXd t = VectorXd::LinSpaced(30, 5.0, 5.348);
  const VectorXd command = 0.3 * (20.0 * t.array()).sin();
  const auto held = follow_held(servo, t, command);
  for (int k = 0; k < t.size(); ++k) {
    double x = command[0];  // rest, and the answer to every jump that has arrived
    for (int i = 1; i < t.size(); ++i)
      if (const double since = t[k] - t[i] - servo.delay; since > 0)
        x += (command[i] - command[i - 1]) * integrated(servo, {0.0, 0.0}, 1.0, 0.0, since)[0];
    CHECK(held(k, 0) == Approx(x).margin(1e-9));
  }
}

}  // namespace servo_bank_test
