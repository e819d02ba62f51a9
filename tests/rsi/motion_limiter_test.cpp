#include <kr5/rsi/motion_limiter.hpp>

#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

using namespace kr5;
using namespace kr5::rsi;

namespace motion_limiter_test {

constexpr double cycle = 0.004;
constexpr double rounding = 1e-9;

double wild(Random& random) {
  switch (random.integer(8)) {
    case 0:
      return std::numeric_limits<double>::quiet_NaN();
    case 1:
      return std::numeric_limits<double>::infinity();
    case 2:
      return -1e300;
    case 3:
      return random.normal(1e-6);
    default:
      return random.normal(std::pow(10, random.uniform(-4, 2)));
  }
}

TEST_CASE("speed, acceleration and total hold for any demands") {
  Random random(5);
  for (int run = 0; run < 200; ++run) {
    const MotionLimits limits{std::pow(10, random.uniform(-3, 1)), std::pow(10, random.uniform(-2, 2)),
                              std::pow(10, random.uniform(-4, 1))};
    MotionLimiter limiter(limits, cycle);
    double x = 0, v = 0, demand = 0;
    for (int k = 0; k < 2000; ++k) {
      if (random.integer(10) == 0) demand = wild(random);
      const int kind = random.integer(12);
      const double next = kind == 0 ? limiter.brake() : kind < 4 ? limiter.move(demand) : limiter.follow(demand);
      const double speed = (next - x) / cycle;
      REQUIRE(std::abs(next) <= limits.total);
      REQUIRE(std::abs(speed) <= limits.speed * (1 + rounding));
      REQUIRE(std::abs(speed - v) <=
              limits.acceleration * cycle * (1 + rounding) + rounding * limits.total / cycle * 1e-3);
      CHECK((limiter.value() == next && limiter.speed() == speed));
      x = next;
      v = speed;
    }
  }
}

TEST_CASE("a demand within the limits is followed exactly, without delay") {
  MotionLimiter limiter({0.1, 1.0, 0.02}, cycle);
  for (int k = 1; k < 2000; ++k) {  // 0.015 w = 0.045 m/s, 0.015 w^2 = 0.135 m/s^2
    const double w = 3.0, t = cycle * k, demand = 0.015 * (1 - std::cos(w * t)) / 2;
    CHECK(std::abs(limiter.follow(demand) - demand) < 1e-12);
  }
}

TEST_CASE("behind a jump it arrives as quickly as it may, goes not beyond, and stays") {
  for (const double jump : {1e-5, 1e-3, 0.019, -0.02}) {
    const MotionLimits limits{0.1, 1.0, 0.02};
    MotionLimiter limiter(limits, cycle);
    int cycles = 0;
    double furthest = 0;
    while (std::abs(limiter.value() - jump) > 1e-12 && cycles < 10000) {
      furthest = std::max(furthest, limiter.follow(jump) / jump);
      ++cycles;
    }
    CHECK(furthest <= 1 + 1e-9);
    const double size = std::abs(jump), ramp = limits.speed * limits.speed / limits.acceleration;
    const double least = size < ramp ? 2 * std::sqrt(size / limits.acceleration) : size / limits.speed + limits.speed;
    CHECK(cycles * cycle < least + 4 * cycle);
    for (int k = 0; k < 100; ++k) CHECK(limiter.follow(jump) == Approx(jump).epsilon(1e-9));
  }
}

TEST_CASE("a demand beyond the total ends at the total, at rest") {
  MotionLimiter limiter({0.5, 2.0, 0.01}, cycle);
  for (int k = 0; k < 1000; ++k) limiter.move(1.0);
  CHECK(limiter.value() == Approx(0.01).epsilon(1e-9));
  CHECK(std::abs(limiter.speed()) < 1e-9);
  for (int k = 0; k < 1000; ++k) limiter.follow(-5.0);
  CHECK(limiter.value() == Approx(-0.01).epsilon(1e-9));
}

TEST_CASE("braking stops within v^2 / 2a, and standing is at rest") {
  MotionLimiter limiter({0.1, 1.0, 1.0}, cycle);
  for (int k = 0; k < 100; ++k) limiter.move(1.0);
  const double from = limiter.value();
  for (int k = 0; k < 26; ++k) limiter.follow(std::numeric_limits<double>::quiet_NaN());
  CHECK(limiter.speed() == Approx(0.0).margin(1e-12));
  CHECK(limiter.value() - from <= 0.1 * 0.1 / 2);
  for (const double value : {0.5, 0.0}) {
    limiter.stand(value);
    CHECK((limiter.value() == value && limiter.speed() == 0));
    CHECK(limiter.follow(value) == value);
  }
  limiter.stand(7.0);
  CHECK(limiter.value() == 1.0);
  limiter.stand(std::numeric_limits<double>::quiet_NaN());
  CHECK(limiter.value() == 0.0);
}

TEST_CASE("a total of nothing allows no correction") {
  MotionLimiter limiter({0.1, 1.0, 0.0}, cycle);
  for (const double d : {1.0, -1.0, 0.0}) CHECK((limiter.follow(d) == 0.0 && limiter.move(d) == 0.0));
}

TEST_CASE("limits that are none are refused") {
  for (const MotionLimits& bad :
       {MotionLimits{0, 1, 1}, {NAN, 1, 1}, {1, 0, 1}, {1, INFINITY, 1}, {1, 1, -1}, {1, 1, NAN}})
    CHECK_THROWS_AS(MotionLimiter(bad, cycle), InvalidArgument);
  for (const double bad : {0.0, -1.0, double(NAN), double(INFINITY)})
    CHECK_THROWS_WITH(MotionLimiter({}, bad), Catch::StartsWith("cycle"));
}

}  // namespace motion_limiter_test
