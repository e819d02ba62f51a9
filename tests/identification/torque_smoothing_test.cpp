#include <kr5/identification/torque_smoothing.hpp>

#include <cmath>
#include <limits>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

namespace torque_smoothing_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using Eigen::Index;

namespace {

constexpr double step = 0.004;

/// One joint about a vertical axis, whose torque is that of its rotor and of dry friction.
DynamicsModel turntable() {
  DynamicsModel model;
  model.chain.joints = {{kinematics::JointType::Revolute, 0, 0, 0.3, 0, 0}};
  return model;
}

/// Turns to and fro for 24 s, with noise of the torque [N m].
JointLog turns(double friction, double noise) {
  constexpr Index n = 6000;
  Random random(4);
  JointLog log;
  log.t = step * Eigen::VectorXd::LinSpaced(n, 0, n - 1);
  log.q = log.tau = Eigen::MatrixXd::Zero(n, 1);
  for (Index i = 0; i < n; ++i) {
    const double t = log.t[i];
    const double qd = 1.8 * std::cos(2 * t) + 1.5 * std::cos(5 * t + 1);
    const double qdd = -3.6 * std::sin(2 * t) - 7.5 * std::sin(5 * t + 1);
    log.q(i, 0) = 0.9 * std::sin(2 * t) + 0.3 * std::sin(5 * t + 1) + random.normal(1e-5);
    log.tau(i, 0) = 3.0 * qdd + 2.0 * qd + std::copysign(friction, qd) + random.normal(noise);
  }
  return log;
}

}  // namespace

TEST_CASE("the steps of dry friction are not smoothed where torques have little noise") {
  const std::vector<JointLog> logs = {turns(20.0, 0.05)};
  const TorqueSmoothing found = choose_torque_smoothing(logs, {}, turntable());
  CAPTURE(found.error_logged, found.error_smoothed);
  CHECK_FALSE(found.smooth);
  CHECK(found.error_logged < 0.95 * found.error_smoothed);
}

TEST_CASE("torques are smoothed where both ways predict alike") {
  const std::vector<JointLog> logs = {turns(0.0, 1.0), turns(0.0, 0.5)};
  const TorqueSmoothing found = choose_torque_smoothing(logs, {}, turntable());
  CAPTURE(found.error_logged, found.error_smoothed);
  CHECK(found.smooth);
  CHECK(std::isfinite(found.error_smoothed));
  CHECK(found.error_logged > 0.95 * found.error_smoothed);
}

TEST_CASE("a log that tells no dynamics leaves the choice at smoothing") {
  std::vector<JointLog> logs = {turns(20.0, 0.05)};
  logs[0].tau(9, 0) = std::numeric_limits<double>::quiet_NaN();
  const TorqueSmoothing found = choose_torque_smoothing(logs, {}, turntable());
  CHECK(found.smooth);
  CHECK(std::isinf(found.error_smoothed));
  CHECK(std::isinf(found.error_logged));
  CHECK_THROWS_WITH(choose_torque_smoothing({}, {}, turntable()), Contains("at least one"));
}

TEST_CASE("a log is split by its time, not by its rows") {
  JointLog log = turns(0.0, 0.1);
  log.t.tail(3000).array() += 6.0;  // 30 s, of which the last 9 s have 2250 rows
  log.t[0] = std::numeric_limits<double>::quiet_NaN();
  log.t[1] = 0.0;
  const auto [first, last] = split_log(log, 0.3);
  CHECK(first.t.size() + last.t.size() == 6000);
  CHECK(last.t.size() == Approx(2250).margin(2));
  CHECK(std::isnan(first.t[0]));
  CHECK(last.t.minCoeff() >= 0.7 * log.t.tail(1)[0]);
  CHECK(first.q.rows() == first.t.size());
  CHECK(first.qd.size() == 0);
  CHECK_THROWS_WITH(split_log(log, 1.5), Contains("last"));
}

}  // namespace torque_smoothing_test
