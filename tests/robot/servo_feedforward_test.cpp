// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/robot/servo_feedforward.hpp>

#include <cmath>

#include <Eigen/Core>
#include <catch2/catch.hpp>

namespace servo_feedforward_test {

using namespace kr5;
using robot::ServoFeedforward;

TEST_CASE("a servo that is led ahead by its inverse needs no acceleration but that of the path") {
  const double w = 12.0, zeta = 0.7;
  const ServoFeedforward lead(w, zeta);
  for (const double t : {0.0, 0.3, 1.1}) {
    const double x = std::sin(3 * t), v = 3 * std::cos(3 * t), a = -9 * std::sin(3 * t);
    CHECK(w * w * (x + lead(v, a) - x) - 2 * zeta * w * v == Approx(a).margin(1e-12));
  }
  const Eigen::Vector2d speed(1.0, -2.0), acceleration(3.0, 0.5);
  CHECK(lead(speed, acceleration)[1] == lead(-2.0, 0.5));
}

TEST_CASE("a servo that follows at once needs no lead") {
  const ServoFeedforward lead(0.0, 0.7);
  CHECK(lead(5.0, 100.0) == 0.0);
}

}  // namespace servo_feedforward_test
