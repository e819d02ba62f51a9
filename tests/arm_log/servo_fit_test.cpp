#include <kr5/arm_log/servo_fit.hpp>

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/arm_log/log_recording.hpp>
#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>

#include "arm_log/servo_arms.hpp"

namespace servo_fit_test {

using namespace kr5;
using namespace kr5::test;
using Catch::Contains;

namespace {

/// What the fit should find of an effect: viscous friction acts as damping does.
double truth(const cell::Cell& arm, const std::string& effect, int joint) {
  const cell::TorqueServo& servo = arm.servo->torque[static_cast<std::size_t>(std::max(joint, 0))];
  if (effect == "servo_stiffness") return servo.stiffness;
  if (effect == "servo_damping") return servo.damping + arm.drives->friction.viscous[joint];
  if (effect == "coulomb_friction") return arm.drives->friction.coulomb[joint];
  if (effect == "rotor_inertia") return arm.drives->rotor_inertia[joint];
  return servo.delay;
}

/// The same commands to servos of another gain.
arm_log::ArmLog with_gain(arm_log::ArmLog log, cell::Cell arm, double gain) {
  for (cell::TorqueServo& servo : arm.servo->torque) servo.stiffness *= gain;
  log.q = encoder_readings(servo_positions(arm, log.t, log.command));
  log.servo_gain = Eigen::VectorXd::Constant(log.t.size(), gain);
  return log;
}

int joint_of(const std::string& target) { return target.starts_with("joint") ? target.back() - '1' : -1; }

}  // namespace

TEST_CASE("servos, friction and rotors are found from gains of another scale", "[not_sanitized]") {
  const auto seed = static_cast<std::uint64_t>(GENERATE(7601, 7602, 7603));
  Random random(seed);
  const cell::Cell arm = servo_arm(4, random), model = ignorant(arm, random);
  INFO("model stiffness " << model.servo->torque[0].stiffness);
  const arm_log::ServoFit found = arm_log::identify_servos(servo_log(arm, random), model);
  CHECK(found.fit.effects.size() == 4 * 4 + 1);
  for (const gap::ColumnFit& column : found.fit.columns) {
    INFO(column.column << ": noise " << column.noise << ", before " << column.before << ", after " << column.after);
    CHECK(column.after < 2.0 * column.noise);
    CHECK(column.check_after < 2.0 * column.noise);
    CHECK(column.before > 5.0 * column.noise);
  }
  for (const gap::FittedEffect& e : found.fit.effects) {
    const gap::ParameterEstimate& p = e.parameters.front();
    const double right = truth(arm, e.effect, joint_of(e.target));
    INFO(e.effect << "." << e.target << ": " << p.value[0] << " +- " << p.std[0] << ", truth " << right);
    CHECK(std::abs(p.value[0] - right) < 5 * p.std[0] + 0.1 * std::abs(right) + 2e-3);
  }
}

TEST_CASE("friction that grows with the load and the scale of a gain are found from logs of two gains") {
  const auto seed = static_cast<std::uint64_t>(GENERATE(7651, 7652, 7653));
  Random random(seed);
  cell::Cell arm = servo_arm(2, random);
  arm.robot.links[1].mass = random.uniform(1.0, 1.5);  // a load that changes with the angle
  const double coefficient = random.uniform(0.25, 0.5), gain = random.uniform(2.0, 4.0);
  const cell::Cell model = ignorant(arm, random);
  cell::set_effect(arm, "load_friction", "joint2", "coefficient", coefficient);
  cell::Recording recording = arm_log::record_log(servo_log(arm, random, 20.0), model).recording;
  const arm_log::ArmLog other = with_gain(servo_log(arm, random, 20.0), arm, gain);
  for (cell::Experiment& e : recording.experiments) e.split = cell::Split::Fit;
  cell::Experiment judged = arm_log::record_log(other, model).recording.experiments.front();
  judged.name = "judged";
  judged.split = cell::Split::Check;
  recording.experiments.push_back(judged);
  recording.cell.noise.position = 4e-4;
  const gap::JointFit found = arm_log::identify_servos(recording);
  for (const gap::FittedEffect& e : found.effects)
    UNSCOPED_INFO(e.effect << "." << e.target << " " << e.parameters.front().value[0] << " +- "
                           << e.parameters.front().std[0] << ", departs by " << e.departure);
  for (const gap::ColumnFit& c : found.columns) UNSCOPED_INFO(c.column << " leaves " << c.after / c.noise << " noise");
  const auto law = std::ranges::find_if(
      found.effects, [](const auto& e) { return e.effect == "load_friction" && e.target == "joint2"; });
  REQUIRE(law != found.effects.end());
  CHECK(law->parameters.front().value[0] == Approx(coefficient).epsilon(0.15));
  CHECK(law->departure > arm_log::surely_different);
  for (const gap::ColumnFit& column : found.columns) {
    INFO(column.column << ": after " << column.after << ", judged " << column.check_after);
    CHECK(column.check_after < 2.0 * column.noise);
  }
}

TEST_CASE("logs and models without servos are refused with a remedy") {
  Random random(7610);
  cell::Cell arm = servo_arm(2, random);
  arm_log::ArmLog log = servo_log(arm, random, 10.0);
  CHECK(arm_log::moves_by_torque_servos(arm_log::record_log(log, arm).recording));
  arm_log::ArmLog silent = log;
  silent.command.resize(0, 0);
  CHECK_THROWS_WITH(arm_log::identify_servos(silent, arm), Contains("command"));
  cell::Recording recording = arm_log::record_log(log, arm).recording;
  recording.cell.servo.reset();
  CHECK(!arm_log::moves_by_torque_servos(recording));
  CHECK_THROWS_WITH(arm_log::identify_servos(recording), Contains("servo.torque"));
}

}  // namespace servo_fit_test
