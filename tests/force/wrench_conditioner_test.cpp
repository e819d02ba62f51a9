#include <kr5/force/wrench_conditioner.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <Eigen/Geometry>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

namespace wrench_conditioner_test {

using namespace kr5;
using namespace kr5::force;

namespace {

/// Amplitude of what comes out of a sine of amplitude 1.
double gain_at(double frequency, double cutoff, double cycle) {
  WrenchLowPass filter(cutoff, cycle);
  double c = 0.0, s = 0.0;
  const int settle = 2000, count = 4000;
  for (int k = 0; k < settle + count; ++k) {
    const double phase = 2 * M_PI * frequency * cycle * k;
    const double out = filter.step(Vector6::Constant(std::sin(phase)))[3];
    if (k < settle) continue;
    c += out * std::cos(phase);
    s += out * std::sin(phase);
  }
  return 2 * std::hypot(c, s) / count;
}

}  // namespace

TEST_CASE("the low-pass is a Butterworth of fourth order") {
  for (const double cutoff : {5.0, 10.0, 30.0}) {
    const double cycle = 0.012, warped = std::tan(M_PI * cutoff * cycle);
    for (const double frequency : {1.0, 4.0, 9.0, 21.0, 37.0}) {
      const double ratio = std::tan(M_PI * frequency * cycle) / warped;
      CHECK(gain_at(frequency, cutoff, cycle) == Approx(1 / std::sqrt(1 + std::pow(ratio, 8))).margin(2e-3));
    }
  }
}

TEST_CASE("noise that is left, and the delay, are those of the reference") {
  const double cycle = 0.012;
  const auto left = [&](double cutoff) {
    WrenchLowPass filter(cutoff, cycle);
    Random random(5);
    double sum = 0.0;
    for (int k = 0; k < 40000; ++k) sum += std::pow(filter.step(random.normal_vector(6, 1.0))[0], 2);
    return std::sqrt(sum / 40000);
  };
  // The book's 40 Hz at 83.3 Hz filters nothing (I-21); 5 to 10 Hz do.
  CHECK(left(40.0) == Approx(0.98).margin(0.01));
  CHECK(WrenchLowPass(40.0, cycle).delay() / cycle == Approx(0.08).margin(0.01));
  CHECK(left(5.0) == Approx(0.35).margin(0.015));
  CHECK(left(10.0) == Approx(0.49).margin(0.015));
  CHECK(WrenchLowPass(5.0, cycle).delay() == Approx(0.082).margin(0.002));
  CHECK(WrenchLowPass(10.0, cycle).delay() == Approx(0.040).margin(0.002));
}

TEST_CASE("a ramp comes out late by the delay, a constant at once") {
  WrenchLowPass filter(8.0, 0.012);
  const Vector6 constant = Vector6::LinSpaced(1.0, 6.0);
  for (int k = 0; k < 20; ++k) CHECK((filter.step(constant) - constant).norm() < 1e-12);
  double out = 0.0;
  for (int k = 1; k <= 500; ++k) out = filter.step(constant + Vector6::Constant(0.012 * k))[0];
  CHECK(out == Approx(1.0 + 0.012 * 500 - filter.delay()).margin(1e-9));
}

TEST_CASE("the tool's weight is taken away in any orientation, the offset by tare") {
  Random random(6);
  const WrenchConditionerOptions options{.mass = 2.3, .com = {0.01, -0.02, 0.15}};
  Vector6 offset;
  offset << 3.0, -1.0, 2.0, 0.1, 0.2, -0.3;
  for (int trial = 0; trial < 50; ++trial) {
    WrenchConditioner conditioner(options);
    const Eigen::Matrix3d R = Eigen::Quaterniond::UnitRandom().toRotationMatrix();
    const Eigen::Vector3d weight = R.transpose() * Eigen::Vector3d(0, 0, -2.3 * 9.81);
    Vector6 reading;
    reading << weight, options.com.cross(weight);
    CHECK((conditioner.step(reading + offset, R) - offset).norm() < 1e-9);
    conditioner.tare();
    CHECK(conditioner.step(reading + offset, R).norm() < 1e-9);
    const Vector6 touch = random.normal_vector(6, 5.0);
    for (int k = 0; k < 300; ++k) conditioner.step(reading + offset + touch, R);
    CHECK((conditioner.step(reading + offset + touch, R) - touch).norm() < 1e-6);
  }
}

TEST_CASE("options that cannot be are refused") {
  CHECK_THROWS_WITH(WrenchLowPass(50.0, 0.012), Catch::Contains("cutoff"));
  CHECK_THROWS_WITH(WrenchLowPass(5.0, 0.0), Catch::Contains("cycle"));
  CHECK_THROWS_WITH(WrenchConditioner({.mass = -1.0}), Catch::Contains("mass"));
}

TEST_CASE("a reading that is no number is told in its cycle, and spoils neither filter nor tare") {
  const Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  const Vector6 good = Vector6::Constant(2.0);
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    CAPTURE(bad);
    WrenchConditioner conditioner(WrenchConditionerOptions{}), undisturbed(WrenchConditionerOptions{});
    Vector6 broken = good;
    broken[3] = bad;
    conditioner.step(good, R);
    CHECK_FALSE(conditioner.step(broken, R).allFinite());
    undisturbed.step(good, R);
    CHECK((conditioner.step(2 * good, R) - undisturbed.step(2 * good, R)).isZero());
    conditioner.step(good, R);
    conditioner.step(broken, R);
    conditioner.tare();
    CHECK(conditioner.step(good, R).isZero(1e-12));
  }
}

}  // namespace wrench_conditioner_test
