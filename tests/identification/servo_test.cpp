#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/identification/servo.hpp>
#include <kr5/physics/second_order.hpp>

#include "support/coverage.hpp"
#include "support/trials.hpp"

namespace servo_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using Eigen::VectorXd;

namespace {

constexpr double cycle = 0.012, noise = 2e-5;
const cell::SecondOrder book = {3.064, 0.7492, 0.024};

/// The step of the book, 24 mm from 1.006 m, into noise whose neighbours are correlated by `memory`.
ServoLog step_log(const cell::SecondOrder& servo, std::uint64_t seed, double memory = 0.0, double gain = 1.0,
                  double size = 0.024, int samples = 500) {
  ServoLog log;
  log.t = VectorXd::LinSpaced(samples, 0.0, cycle * (samples - 1));
  log.command = VectorXd::Constant(samples, 1.006);
  log.command.tail(samples - 20).array() += size;
  log.response = gain * physics::follow_held(servo, log.t, log.command).col(0);
  Random random(seed);
  double last = random.normal(noise);
  for (int i = 0; i < samples; ++i) {
    log.response[i] += last;
    last = memory * last + std::sqrt(1 - memory * memory) * random.normal(noise);
  }
  return log;
}

double std_of(const ServoResult& result, int index) { return std::sqrt(result.covariance(index, index)); }

}  // namespace

TEST_CASE("the formula of the overshoot gives 0.7454 and 3.0445 rad/s from the figures that the book quotes") {
  const cell::SecondOrder servo = servo_from_overshoot(24.0, 0.7153, 3.096);
  CHECK(servo.damping_ratio == Approx(0.7454).margin(5e-5));
  CHECK(servo.natural_frequency == Approx(3.0445).margin(5e-4));
  // The printed damping ratio and period give the printed frequency, so that it is the undamped one.
  CHECK(2 * 3.14159265 / (3.096 * std::sqrt(1 - 0.7492 * 0.7492)) == Approx(3.064).margin(5e-4));
  CHECK_THROWS_WITH(servo_from_overshoot(24, 25, 3), Contains("overshoot must lie between 0 and the step"));
  CHECK_THROWS_WITH(servo_from_overshoot(24, 1, 0), Contains("period must be positive"));
}

TEST_CASE("a step tells the servo of the book, and what it cannot tell") {
  const ServoResult result = identify_servo(step_log(book, 1));
  REQUIRE(result.fit.usable());
  CHECK(std::abs(result.servo.natural_frequency - 3.064) < 3 * std_of(result, 0));
  CHECK(std::abs(result.servo.damping_ratio - 0.7492) < 3 * std_of(result, 1));
  CHECK(std::abs(result.servo.delay - 0.024) < 3 * std_of(result, 2));
  CHECK(std::abs(result.gain - 1.0) < 3 * std_of(result, 3));
  CHECK(std_of(result, 0) < 0.003 * 3.064);
  CHECK(result.noise == Approx(noise).epsilon(0.15));
  CHECK(result.max_speed == Approx(0.032).epsilon(0.05));  // the 2 m/s of the book are never approached (I-16)
  REQUIRE(result.overshoot);
  CHECK(result.overshoot->overshoot == Approx(0.687e-3).margin(4 * noise));  // 24 mm with 0.7492
  CHECK(result.overshoot->damping_ratio == Approx(0.7492).margin(0.02));
  CHECK(result.overshoot->second_overshoot == Approx(0.56e-6).epsilon(0.1));
  CHECK(result.warnings.empty());
  REQUIRE(result.overshoot_limits.size() == 1);
  CHECK_THAT(result.overshoot_limits[0], Contains("second overshoot"));
}

TEST_CASE("the delay is a number, not a count of cycles, and every kind of servo is found from far away") {
  for (const cell::SecondOrder& truth : std::vector<cell::SecondOrder>{
           {3.064, 0.7492, 0.0}, {3.064, 0.7492, 0.0173}, {12.0, 0.3, 0.041}, {1.2, 1.4, 0.1}, {45.0, 0.85, 0.012}}) {
    CAPTURE(truth.natural_frequency, truth.delay);
    const ServoResult result = identify_servo(step_log(truth, 2, 0.0, 0.98));
    REQUIRE(result.fit.usable());
    CHECK(std::abs(result.servo.natural_frequency - truth.natural_frequency) < 4 * std_of(result, 0));
    CHECK(std::abs(result.servo.damping_ratio - truth.damping_ratio) < 4 * std_of(result, 1));
    CHECK(std::abs(result.servo.delay - truth.delay) < 4 * std_of(result, 2));
    CHECK(std_of(result, 2) < 0.005);
    CHECK(std::abs(result.gain - 0.98) < 4 * std_of(result, 3));
  }
}

TEST_CASE("a joint that follows a smooth command") {
  const cell::SecondOrder joint = {45.0, 0.85, 0.012};
  ServoLog log;
  const int n = 400;
  log.t = VectorXd::LinSpaced(n, 0, cycle * (n - 1));
  log.command = 0.3 * (3.0 * log.t.array()).sin() + 0.1 * (11.0 * log.t.array()).sin();
  log.response = physics::follow_smooth(joint, log.t, log.command).col(0);
  Random random(3);
  log.response += random.normal_vector(n, noise);
  const ServoResult result =
      identify_servo(log, {.command = CommandShape::Smooth, .fit_gain = false, .fit_offset = false});
  REQUIRE(result.fit.usable());
  CHECK(std::abs(result.servo.natural_frequency - 45.0) < 3 * std_of(result, 0));
  CHECK(std::abs(result.servo.delay - 0.012) < 3 * std_of(result, 2));
  CHECK(result.gain == 1.0);
  CHECK(std_of(result, 3) == 0.0);
  CHECK_FALSE(result.overshoot);
}

TEST_CASE("the stated covariance of a servo holds, also with correlated noise", "[statistics]") {
  for (const double memory : {0.0, 0.8}) {
    CAPTURE(memory);
    test::Coverage coverage("identify_servo, correlation " + std::to_string(memory), 5);
    const int trials = test::trials(2000, 120);
    Eigen::Matrix<double, 5, 1> truth;
    truth << 3.064, 0.7492, 0.024, 0.98, 0.0;
    for (int k = 0; k < trials; ++k) {
      const ServoResult result =
          identify_servo(step_log(book, 100 + static_cast<std::uint64_t>(k), memory, 0.98, 0.024, 1000));
      REQUIRE(result.fit.usable());
      Eigen::Matrix<double, 5, 1> found;
      found << result.servo.natural_frequency, result.servo.damping_ratio, result.servo.delay, result.gain,
          result.offset;
      coverage.add(found - truth, result.covariance, test::known_noise);
    }
    coverage.check_rate();
  }
}

TEST_CASE("responses that tell no servo are refused with the reason") {
  ServoLog log = step_log(book, 4);
  log.command.setConstant(1.006);
  CHECK_THAT(identify_servo(log).fit.message, Contains("the command does not change"));

  log = step_log(book, 4, 0.0, 1.0, 3e-6);
  CHECK_FALSE(identify_servo(log).fit.usable());
  CHECK_THAT(identify_servo(log).fit.message, Contains("too small against the noise"));

  log = step_log(book, 4);
  const VectorXd early = log.response.tail(460);  // 40 samples early, of which 20 before the step
  log.response.head(460) = early;
  log.response.tail(40).setConstant(1.03);
  CHECK_THAT(identify_servo(log).fit.message, Contains("before the command"));

  log = step_log(book, 4);
  std::swap(log.command, log.response);
  CHECK_FALSE(identify_servo(log).fit.usable());

  log = step_log(book, 4, 0.0, -1.0);
  CHECK_FALSE(identify_servo(log).fit.usable());

  log = step_log(book, 4);
  log.t.conservativeResize(5), log.command.conservativeResize(5), log.response.conservativeResize(5);
  CHECK_THAT(identify_servo(log).fit.message, Contains("found 5 samples"));
}

TEST_CASE("a speed at its limit is named with its time") {
  ServoLog log = step_log(book, 5, 0.0, 1.0, 0.2, 900);
  const double limit = 0.1;  // a linear servo would reach 0.26 m/s
  double z = 1.006, v = 0.0;
  Random random(6);
  constexpr int fine = 100;
  for (Eigen::Index i = 0; i < log.t.size(); ++i) {
    log.response[i] = z + random.normal(noise);
    const double u = log.command[std::max<Eigen::Index>(i - 2, 0)];
    for (int k = 0; k < fine; ++k) {
      v += cycle / fine * physics::servo_acceleration(book, u, z, v);
      v = std::clamp(v, -limit, limit);
      z += cycle / fine * v;
    }
  }
  const ServoResult result = identify_servo(log);
  CHECK_FALSE(result.fit.usable());
  CHECK_THAT(result.fit.message, Contains("the speed is limited to 0.1"));
}

TEST_CASE("a log with an invalid number or time is refused with its row") {
  ServoLog log = step_log(book, 7);
  log.response[12] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(identify_servo(log), Contains("response: row 12 is not finite"));
  log = step_log(book, 7);
  log.t[9] = log.t[8];
  CHECK_THROWS_WITH(identify_servo(log), Contains("t: row 9 is not later"));
  log = step_log(book, 7);
  log.command.conservativeResize(7);
  CHECK_THROWS_WITH(identify_servo(log), Contains("command: expected 500 numbers, found 7"));
  CHECK_THROWS_WITH(identify_servo(step_log(book, 7), {.max_delay = 0.0}), Contains("max_delay"));
}

}  // namespace servo_test
