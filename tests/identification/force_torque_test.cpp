#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/identification/force_torque.hpp>
#include <kr5/kinematics/newton_euler.hpp>
#include <kr5/physics/second_order.hpp>
#include <kr5/physics/wrench_sensor.hpp>

#include "support/coverage.hpp"
#include "support/trials.hpp"

namespace force_torque_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double force_noise = 0.15, torque_noise = 0.008;

/// What stands in the world of a test.
struct World {
  physics::WrenchSensor sensor;
  double mass = 2.4;
  Vector3d com = {0.004, 0.002, 0.085};
  Matrix3d R_flange_sensor = Matrix3d::Identity();

  World() { sensor.bias << 1.2, -0.7, 3.0, 0.05, -0.1, 0.02; }
};

Vector6 weight(double mass, const Vector3d& com, const Vector3d& gravity) {
  Vector6 out;
  out << mass * gravity, com.cross(mass * gravity);
  return out;
}

/// Postures with the sensor turned at random, every third with a known load of another place when there are loads.
std::vector<ForceTorqueReading> postures(const World& world, int count, std::uint64_t seed, bool loads = false,
                                         double noise = 1.0) {
  Random random(seed);
  std::vector<ForceTorqueReading> out;
  for (int i = 0; i < count; ++i) {
    ForceTorqueReading reading;
    reading.gravity = 9.81 * random.direction();
    reading.t = 10.0 * i;
    if (loads && i % 3 > 0) {
      reading.load_mass = i % 3 == 1 ? 3.0 : 5.0;
      reading.load_com = 0.15 * random.direction();
    }
    const Vector3d gravity = world.R_flange_sensor.transpose() * reading.gravity;
    reading.wrench = world.sensor.distorted(
        weight(world.mass, world.com, gravity) + weight(reading.load_mass, reading.load_com, gravity), reading.t);
    reading.wrench.head<3>() += Vector3d(random.normal_vector(3, noise * force_noise));
    reading.wrench.tail<3>() += Vector3d(random.normal_vector(3, noise * torque_noise));
    out.push_back(reading);
  }
  return out;
}

const SensorParameter& parameter(const ForceTorqueResult& result, const std::string& name) {
  for (const SensorParameter& p : result.parameters)
    if (p.name == name) return p;
  throw InvalidArgument("no parameter " + name);
}

}  // namespace

TEST_CASE("bias, mass and centre of the tool from a dozen postures, exact without noise") {
  const World world;
  ForceTorqueResult exact = identify_force_torque(postures(world, 12, 1, false, 0.0));
  REQUIRE(exact.fit.usable());
  CHECK((exact.bias - world.sensor.bias).norm() < 1e-5);
  CHECK(exact.mass == Approx(2.4).epsilon(1e-6));
  CHECK((exact.com - world.com).norm() < 1e-6);
  const ForceTorqueResult result = identify_force_torque(postures(world, 12, 2));
  REQUIRE(result.fit.usable());
  CHECK(std::abs(parameter(result, "tool.mass").value - 2.4) < 3 * parameter(result, "tool.mass").std);
  CHECK(std::abs(parameter(result, "bias.fz").value - 3.0) < 3 * parameter(result, "bias.fz").std);
  CHECK(parameter(result, "tool.mass").std < 0.01);
  CHECK(result.outliers.empty());
  CHECK(result.warnings.empty());
}

TEST_CASE("the orientation of the sensor on the flange") {
  World world;
  world.R_flange_sensor = to_pose((Vector6() << 0, 0, 0, 0.02, -0.03, 0.1).finished()).linear();
  const auto readings = postures(world, 30, 3, false, 0.01);
  const ForceTorqueResult result = identify_force_torque(readings, {.fit_orientation = true});
  REQUIRE(result.fit.usable());
  CHECK((result.T_flange_sensor.linear() - world.R_flange_sensor).norm() < 2e-3);
  CHECK(result.force_noise == Approx(0.01 * force_noise).epsilon(0.3));
}

TEST_CASE("gain and crosstalk from known loads, and drift over time") {
  World world;
  world.sensor.gain.diagonal() << 1.03, 0.97, 1.01, 0.99, 1.02, 0.98;
  world.sensor.gain(0, 4) = 0.3;
  world.sensor.gain(5, 2) = 0.002;
  world.sensor.rate << 0.002, 0, -0.001, 0, 1e-4, 0;
  const auto readings = postures(world, 90, 4, true, 0.05);
  const ForceTorqueResult result = identify_force_torque(readings, {.gain = GainModel::Crosstalk, .fit_drift = true});
  INFO(result.fit.message);
  REQUIRE(result.fit.usable());
  CHECK((result.gain - world.sensor.gain).cwiseAbs().maxCoeff() < 0.03);
  for (const char* name : {"gain.fx", "gain.tz", "crosstalk.fx.ty", "crosstalk.tz.fz", "drift.fz", "tool.mass"}) {
    CAPTURE(name);
    const SensorParameter& p = parameter(result, name);
    const double truth = std::string(name) == "gain.fx"           ? 1.03
                         : std::string(name) == "gain.tz"         ? 0.98
                         : std::string(name) == "crosstalk.fx.ty" ? 0.3
                         : std::string(name) == "crosstalk.tz.fz" ? 0.002
                         : std::string(name) == "drift.fz"        ? -0.001
                                                                  : 2.4;
    CHECK(std::abs(p.value - truth) < 3.5 * p.std);
  }
}

TEST_CASE("what postures cannot tell is named") {
  const World world;
  std::vector<ForceTorqueReading> upright = postures(world, 12, 5);
  for (ForceTorqueReading& reading : upright) {
    reading.gravity = {0, 0, -9.81};
    reading.wrench = world.sensor.distorted(weight(world.mass, world.com, reading.gravity), 0.0);
  }
  const ForceTorqueResult result = identify_force_torque(upright);
  CHECK_FALSE(result.fit.usable());
  CHECK_THAT(result.fit.message, Contains("do not determine") && Contains("bias.fz") && Contains("tool.mass"));
  CHECK_THAT(result.fit.message, !Contains("bias.fx,"));
  CHECK_FALSE(parameter(result, "tool.mass").told);

  const ForceTorqueResult gain = identify_force_torque(postures(world, 40, 6), {.gain = GainModel::Diagonal});
  CHECK_FALSE(gain.fit.usable());
  CHECK_THAT(gain.fit.message, Contains("gain.fx") && Contains("tool.mass") && Contains("known loads"));
}

TEST_CASE("drift is told when it was not asked for, a touch is left out") {
  World world;
  world.sensor.rate[2] = 0.01;
  const ForceTorqueResult drifting = identify_force_torque(postures(world, 40, 7));
  REQUIRE(drifting.warnings.size() == 1);
  CHECK_THAT(drifting.warnings[0], Contains("fz drifts by 0.0"));

  std::vector<ForceTorqueReading> touched = postures(World(), 40, 8);
  touched[13].wrench[2] += 5.0;
  const ForceTorqueResult result = identify_force_torque(touched);
  CHECK(result.outliers == std::vector<int>{13});
  CHECK(std::abs(result.mass - 2.4) < 3 * parameter(result, "tool.mass").std);

  std::vector<ForceTorqueReading> reversed = postures(World(), 40, 9);
  for (ForceTorqueReading& reading : reversed) reading.wrench = -reading.wrench;
  CHECK_THAT(identify_force_torque(reversed).fit.message, Contains("negative mass"));
}

TEST_CASE("a motion is predicted by the law of the dynamics that also simulates") {
  World world;
  const Matrix3d inertia = Vector3d(0.0085, 0.0083, 0.003).asDiagonal();
  kinematics::DhChain chain;
  chain.joints = {{.b = 0.4, .a = 0.18, .alpha = 1.57}, {.a = 0.6, .alpha = 0.3}, {.b = 0.1, .a = 0.12, .alpha = -1.2}};
  cell::Cell cell;
  cell.robot.dh = chain.joints;
  cell.servo = cell::Servo{.cycle = 0.012, .joint = {{20.0, 0.8, 0.012}}, .tool = {}, .correction = {}};
  cell::Tool tool;
  tool.T_flange_sensor = to_pose((Vector6() << 0, 0.01, 0.045, 0, 0.1, 0.5).finished());
  tool.mass = world.mass, tool.com = world.com;
  tool.inertia << inertia.diagonal(), 0, 0, 0;
  cell.tool = tool;
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(300, 0.0, 3.588);
  kinematics::Rows command(300, 3);
  for (int j = 0; j < 3; ++j) command.col(j) = (0.9 + 0.3 * j) * (1.5 * t.array() + j).sin();
  const auto readings = motion_readings(cell, t, command, kinematics::Rows::Zero(300, 6));

  // The wrench by Newton and Euler, from the accelerations at one instant by differences of the same motion.
  kinematics::Dynamics dynamics(chain, std::vector<kinematics::Body>(3), cell.robot.gravity);
  const kinematics::SensorCut cut{.T_link_sensor = tool.T_flange_sensor, .body = {tool.mass, tool.com, tool.inertia}};
  std::vector<ForceTorqueReading> recorded = readings;
  Eigen::MatrixXd q(300, 3), qd(300, 3), qdd(300, 3);
  for (int j = 0; j < 3; ++j) {
    const auto axis = physics::follow_smooth({20.0, 0.8, 0.012}, t, command.col(j));
    q.col(j) = axis.col(0), qd.col(j) = axis.col(1), qdd.col(j) = axis.col(2);
  }
  const Eigen::MatrixXd wrench = -dynamics.loads(q, qd, qdd, cut).wrench;
  for (std::size_t i = 0; i < recorded.size(); ++i)
    recorded[i].wrench = world.sensor.bias + wrench.row(static_cast<Eigen::Index>(i)).transpose();
  const ForceTorqueResult result =
      identify_force_torque(recorded, {.T_flange_sensor = tool.T_flange_sensor, .inertia = tool.inertia});
  REQUIRE(result.fit.usable());
  CHECK(result.mass == Approx(world.mass).epsilon(1e-5));
  CHECK((result.com - world.com).norm() < 1e-5);
  CHECK((result.bias - world.sensor.bias).norm() < 1e-3);
  CHECK(result.force_noise < 1e-4);
}

TEST_CASE("the stated covariance of sensor and tool holds", "[statistics]") {
  World world;
  world.sensor.rate[2] = 0.001;
  test::Coverage coverage("identify_force_torque", 10);
  const int trials = test::trials(2000, 150);
  for (int k = 0; k < trials; ++k) {
    const ForceTorqueResult result =
        identify_force_torque(postures(world, 60, 100 + static_cast<std::uint64_t>(k)), {.fit_drift = true});
    REQUIRE(result.fit.usable());
    Eigen::Matrix<double, 10, 1> error;
    error << result.bias - world.sensor.bias, result.mass - world.mass, result.com - world.com;
    coverage.add(error, result.covariance.topLeftCorner<10, 10>());
  }
  coverage.check_rate();
}

TEST_CASE("readings of the sensor with an invalid number are refused with their row") {
  auto readings = postures(World(), 12, 10);
  readings[3].wrench[1] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(identify_force_torque(readings), Contains("row 3: wrench is not finite"));
  readings = postures(World(), 12, 10);
  readings[5].load_mass = -1;
  CHECK_THROWS_WITH(identify_force_torque(readings), Contains("row 5: load_mass"));
  for (ForceTorqueReading& reading : readings) reading.load_mass = 0, reading.t = 1;
  CHECK_THROWS_WITH(identify_force_torque(readings, {.fit_drift = true}), Contains("fit_drift: needs readings at"));
  CHECK_THROWS_WITH(identify_force_torque({}), Contains("readings: none"));
  CHECK_THROWS_WITH(identify_force_torque(readings, {.force_noise = 0}), Contains("force_noise"));
  cell::Cell cell;
  cell.robot.dh.resize(3);
  CHECK_THROWS_WITH(posture_readings(cell, kinematics::Rows::Zero(2, 6), kinematics::Rows::Zero(2, 6)),
                    Contains("q: expected 3 joint values"));
}

}  // namespace force_torque_test
