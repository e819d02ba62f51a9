// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numbers>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/sim/sensors.hpp>

namespace sensors_test {

using namespace kr5;
using sim::WristSensor;

namespace {

cell::Cell arc() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

sim::WristSensorOptions exact() {
  sim::WristSensorOptions options;
  options.force_resolution = 0.0;
  options.noise = false;
  return options;
}

}  // namespace

TEST_CASE("a sensor without effects, noise and steps tells the wrench, and its bridges give it through their matrix") {
  sim::WristSensorOptions options = exact();
  for (int i = 0; i < 6; ++i) options.calibration(i, (i + 1) % 6) = 3.0 + i;
  WristSensor sensor(arc(), options);
  Vector6 wrench;
  wrench << 1, -20, 30, 0.5, -0.25, 2;
  CHECK((sensor.read(wrench, 0.0) - wrench).norm() < 1e-12);
  CHECK((options.calibration * sensor.voltages() - wrench).norm() < 1e-12);
  CHECK_FALSE(sensor.saturated());
}

TEST_CASE("forces come in sixteenths of a newton, and bridges saturate") {
  sim::WristSensorOptions options = exact();
  options.force_resolution = 0.0625;
  WristSensor sensor(arc(), options);
  CHECK(sensor.read(Vector6::Constant(0.1), 0.0)[0] == 0.125);
  CHECK(sensor.read(Vector6::Constant(0.1), 0.0)[3] == Approx(0.1));
  const Vector6 most = sensor.read(Vector6::Constant(1e4), 0.0);
  CHECK(most[2] == Approx(200.0));
  CHECK(sensor.saturated());
  CHECK(sensor.voltages().maxCoeff() == 10.0);
}

TEST_CASE("bias, drift, gain, crosstalk and lag act sample by sample as in a recording") {
  cell::Cell cell = arc();
  cell::set_effect(cell, "ft_bias", "fy", "bias", 2.0);
  cell::set_effect(cell, "ft_drift", "fy", "rate", 0.5);
  cell::set_effect(cell, "ft_gain", "fz", "gain", 1.1);
  cell::set_effect(cell, "ft_crosstalk", "tx", "source", 2.0);
  cell::set_effect(cell, "ft_crosstalk", "tx", "gain", 0.01);
  WristSensor sensor(cell, exact());
  Vector6 wrench = Vector6::Zero();
  wrench[2] = 10.0;
  const Vector6 read = sensor.read(wrench, 4.0);
  CHECK(read[1] == Approx(4.0));
  CHECK(read[2] == Approx(11.0));
  CHECK(read[3] == Approx(0.1));
  cell = arc();
  cell::set_effect(cell, "ft_lag", "force_torque", "time_constant", 0.05);
  WristSensor slow(cell, exact());
  slow.read(Vector6::Zero(), 0.0);
  for (int k = 1; k <= 10; ++k) slow.read(wrench, 0.012 * k);
  CHECK(slow.read(wrench, 0.12)[2] == Approx(10.0 * (1 - std::exp(-0.12 / 0.05))));
}

TEST_CASE("noise has the size the cell states, and follows the seed") {
  sim::WristSensorOptions options = exact();
  options.noise = true;
  WristSensor a(arc(), options), b(arc(), options);
  double force = 0.0, torque = 0.0;
  const int n = 4000;
  for (int k = 0; k < n; ++k) {
    const Vector6 read = a.read(Vector6::Zero(), 0.0);
    CHECK(read == b.read(Vector6::Zero(), 0.0));
    force += read.head<3>().squaredNorm() / 3;
    torque += read.tail<3>().squaredNorm() / 3;
  }
  const double four_sigma = 4.0 / std::sqrt(2.0 * 3 * n);
  CHECK(std::sqrt(force / n) == Approx(arc().noise.force).epsilon(four_sigma));
  CHECK(std::sqrt(torque / n) == Approx(arc().noise.torque).epsilon(four_sigma));
}

TEST_CASE("encoders count motor turns, coupled joints included") {
  const physics::EffectiveDrives drives(arc());
  const double counts = 1000.0, count = 2 * std::numbers::pi / counts;
  sim::Encoders encoders(drives, counts, 0.0);
  const Eigen::VectorXd q = Eigen::VectorXd::LinSpaced(6, 0.123, -1.234), read = encoders.read(q);
  const Eigen::VectorXd angle = drives.motors->structure * read / count;
  for (const double turns : angle) CHECK(turns == Approx(std::round(turns)).margin(1e-6));
  CHECK((drives.motors->structure * (read - q)).cwiseAbs().maxCoeff() <= count / 2 * (1 + 1e-9));
  sim::Encoders smooth(drives, 0.0, 0.0);
  CHECK(smooth.read(q) == q);
}

TEST_CASE("sensor options that make no sense are refused by name") {
  sim::WristSensorOptions options;
  options.force_resolution = -1.0;
  CHECK_THROWS_WITH(WristSensor(arc(), options), Catch::StartsWith("force_resolution"));
  options = {};
  options.calibration.row(2).setZero();
  CHECK_THROWS_WITH(WristSensor(arc(), options), Catch::StartsWith("calibration: has no inverse"));
  CHECK_THROWS_AS(sim::Encoders(physics::EffectiveDrives(arc()), -1.0, 0.0), InvalidArgument);
}

TEST_CASE("currents are told with the noise that the cell states, and go on from a state") {
  const cell::Cell cell = arc();
  const Eigen::VectorXd current = Eigen::VectorXd::LinSpaced(6, 0.1, 0.6);
  CHECK(sim::CurrentSensors(cell, false).read(current) == current);
  sim::CurrentSensors sensors(cell, true, 5);
  constexpr int count = 4000;
  double squares = 0.0;
  for (int k = 0; k < count; ++k) squares += (sensors.read(current) - current).squaredNorm() / 6.0;
  // The variance of 24,000 samples is known to 0.91 %: four standard deviations.
  CHECK(squares / count ==
        Approx(std::pow(cell.noise.of("current", 0), 2)).epsilon(4 * std::sqrt(2.0 / (6.0 * count))));
  sim::CurrentSensors other(cell, true, 6);
  other.restore(sensors.state());
  CHECK(other.read(current) == sensors.read(current));
  CHECK(sensors.read(Eigen::VectorXd()).size() == 0);
}

}  // namespace sensors_test
