#include <catch2/catch.hpp>

#include <cmath>
#include <functional>

#include <kr5/cell/effect.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/cell/servo_gain.hpp>
#include <kr5/core/error.hpp>
#include <kr5/physics/fold_effects.hpp>
#include <kr5/predict/fast_simulator.hpp>

namespace servo_arm_test {

using namespace kr5;
using Catch::Matchers::Contains;
using Eigen::VectorXd;

namespace {

constexpr double gravity = 9.81, mass = 0.4, arm_length = 0.2, rotor = 0.02;
constexpr double inertia = mass * arm_length * arm_length + rotor;

/// Links of point masses at the ends of rods that swing in one vertical plane; the first hangs along x at 0.
cell::Cell pendulum(int joints = 1) {
  cell::Cell out;
  out.name = "pendulum";
  for (int i = 0; i < joints; ++i) {
    kinematics::DhJoint row;
    row.a = arm_length;
    out.robot.dh.push_back(row);
    cell::Link link;
    link.mass = mass;
    out.robot.links.push_back(link);
  }
  out.robot.gravity = {0.0, -gravity, 0.0};
  out.drives = cell::unit_drives(joints);
  out.drives->rotor_inertia.setConstant(rotor);
  out.servo = cell::Servo{};
  out.servo->cycle = 0.02;
  out.servo->torque = {{.stiffness = 15.0, .damping = 0.5}};
  return out;
}

cell::TorqueServo& servo(cell::Cell& cell) { return cell.servo->torque.front(); }

cell::Experiment commands(double duration, double step, int joints, const std::function<double(double, int)>& command) {
  cell::Experiment out;
  out.name = "motion";
  out.data.columns = {"t"};
  for (int j = 0; j < joints; ++j) out.data.columns.push_back("qc" + std::to_string(j + 1));
  const auto rows = static_cast<Eigen::Index>(std::lround(duration / step)) + 1;
  out.data.values.resize(rows, 1 + joints);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const double t = step * static_cast<double>(k);
    out.data.values(k, 0) = t;
    for (int j = 0; j < joints; ++j) out.data.values(k, 1 + j) = command(t, j);
  }
  return out;
}

VectorXd joint1(const cell::Cell& cell, const cell::Experiment& e, const char* column = "q1") {
  return predict::FastSimulator().predict(cell, e).column(column);
}

double last(const VectorXd& x) { return x[x.size() - 1]; }

double swing(double t, int) { return t < 0.2 ? 0.3 : 0.3 + 0.4 * std::sin(2.0 * (t - 0.2)); }

/// The same pendulum by Runge-Kutta in steps of a hundredth of a row, its command straight between rows.
VectorXd by_runge_kutta(const cell::Cell& cell, const cell::Experiment& e) {
  const cell::TorqueServo& s = cell.servo->torque.front();
  const VectorXd t = e.data.column("t"), u = e.data.column("qc1");
  const auto acceleration = [&](double x, double v, double command) {
    return (s.stiffness * (command - x) - s.damping * v - cell.drives->friction.viscous[0] * v -
            mass * gravity * arm_length * std::cos(x)) /
           inertia;
  };
  VectorXd out(t.size());
  double x = u[0], v = 0.0;
  out[0] = x;
  constexpr int parts = 100;
  for (Eigen::Index k = 0; k + 1 < t.size(); ++k) {
    const double h = (t[k + 1] - t[k]) / parts;
    for (int p = 0; p < parts; ++p) {
      const auto at = [&](double part) { return u[k] + (p + part) / parts * (u[k + 1] - u[k]); };
      const double a1 = acceleration(x, v, at(0)), v1 = v;
      const double v2 = v + 0.5 * h * a1, a2 = acceleration(x + 0.5 * h * v1, v2, at(0.5));
      const double v3 = v + 0.5 * h * a2, a3 = acceleration(x + 0.5 * h * v2, v3, at(0.5));
      const double v4 = v + h * a3, a4 = acceleration(x + h * v3, v4, at(1));
      x += h * (v1 + 2 * v2 + 2 * v3 + v4) / 6;
      v += h * (a1 + 2 * a2 + 2 * a3 + a4) / 6;
    }
    out[k + 1] = x;
  }
  return out;
}

}  // namespace

TEST_CASE("a pendulum under a torque servo moves as by fine Runge-Kutta steps") {
  cell::Cell cell = pendulum();
  servo(cell).hold = cell::CommandHold::FirstOrderHold;
  cell.drives->friction.viscous[0] = 0.1;
  const cell::Experiment e = commands(6.0, 0.02, 1, swing);
  const VectorXd expected = by_runge_kutta(cell, e);
  CHECK((joint1(cell, e) - expected).cwiseAbs().maxCoeff() < 3e-4);
  const cell::Experiment fine = commands(6.0, 0.005, 1, swing);  // the error falls with the square of the step
  CHECK((joint1(cell, fine) - by_runge_kutta(cell, fine)).cwiseAbs().maxCoeff() < 1e-4);
}

TEST_CASE("a servo droops by the load over its stiffness, unless it integrates") {
  cell::Cell cell = pendulum();
  const cell::Experiment e = commands(8.0, 0.02, 1, [](double, int) { return 0.4; });
  const double q = last(joint1(cell, e));
  CHECK(q == Approx(0.4 - mass * gravity * arm_length * std::cos(q) / servo(cell).stiffness).margin(1e-9));
  CHECK(last(joint1(cell, e, "i1")) == Approx(mass * gravity * arm_length * std::cos(q)).margin(1e-6));
  servo(cell).integral = 20.0;
  CHECK(last(joint1(cell, e)) == Approx(0.4).margin(1e-4));
}

TEST_CASE("dry friction holds a joint exactly until more than its level pulls") {
  cell::Cell cell = pendulum();
  cell.robot.gravity.setZero();
  cell.drives->friction.coulomb[0] = 0.3;
  const double edge = 0.3 / servo(cell).stiffness;
  for (const double share : {0.95, 1.3}) {
    const cell::Experiment e = commands(4.0, 0.02, 1, [&](double t, int) { return t < 1.0 ? 0.0 : share * edge; });
    const VectorXd q = joint1(cell, e);
    if (share < 1.0)
      CHECK(q.cwiseAbs().maxCoeff() == 0.0);
    else
      CHECK(last(q) > 0.1 * edge);
    CHECK(q[q.size() - 1] == q[q.size() - 30]);  // it stands
  }
}

TEST_CASE("a limit of torque leaves a joint behind, and a supply voltage limits its speed") {
  cell::Cell cell = pendulum();
  servo(cell).torque_limit = 0.8 * mass * gravity * arm_length;
  const cell::Experiment hold = commands(0.4, 0.02, 1, [](double, int) { return 0.0; });
  const double acceleration = -0.2 * mass * gravity * arm_length / inertia;  // as it begins to fall
  CHECK(last(joint1(cell, hold)) < 0.3 * acceleration * 0.4 * 0.4 / 2);
  cell = pendulum();
  cell.robot.gravity.setZero();
  servo(cell).damping = 0.0;
  servo(cell).stall_torque = 1.0;
  servo(cell).no_load_speed = 2.0;
  const cell::Experiment far = commands(1.0, 0.02, 1, [](double t, int) { return t < 0.1 ? 0.0 : 3.0; });
  const VectorXd q = joint1(cell, far);
  double fastest = 0.0;
  for (Eigen::Index k = 1; k < q.size(); ++k) fastest = std::max(fastest, (q[k] - q[k - 1]) / 0.02);
  CHECK(fastest > 1.8);
  CHECK(fastest <= 2.0);
}

TEST_CASE("an error within the dead band makes no torque") {
  cell::Cell cell = pendulum();
  cell.robot.gravity.setZero();
  cell.drives->friction.coulomb[0] = 1e-3;
  servo(cell).dead_band = 0.02;
  const cell::Experiment e = commands(5.0, 0.02, 1, [](double t, int) { return t < 1.0 ? 0.0 : 0.015; });
  CHECK(joint1(cell, e).cwiseAbs().maxCoeff() == 0.0);
  const cell::Experiment slow = commands(5.0, 0.02, 1, [](double t, int) { return std::min(0.03 * t, 0.1); });
  CHECK(last(joint1(cell, slow)) == Approx(0.08).margin(4e-3));
}

TEST_CASE("drag that grows with the square of the speed slows a joint to where it takes all torque, at any step") {
  cell::Cell cell = pendulum();
  cell.robot.gravity.setZero();
  servo(cell).torque_limit = 0.5;
  cell::set_effect(cell, "quadratic_drag", "joint1", "quadratic", 0.08);
  for (const double step : {0.02, 0.002}) {
    const cell::Experiment far = commands(2.0, step, 1, [](double t, int) { return t < 0.1 ? 0.0 : 20.0; });
    const VectorXd q = joint1(cell, far);
    const Eigen::Index n = q.size();
    CHECK((q[n - 1] - q[n - 11]) / (10 * step) == Approx(2.5).epsilon(2e-3));
  }
}

TEST_CASE("a load that falls against friction of its own is held by less torque than one that is lifted") {
  cell::Cell cell = pendulum();
  cell::set_effect(cell, "driven_friction", "joint1", "coefficient", 0.5);
  const double weight = mass * gravity * arm_length;
  const auto moved = [&](double from, double to) {
    servo(cell) = {.stiffness = 200.0, .damping = 2.0, .hold = cell::CommandHold::FirstOrderHold};
    const cell::Experiment e =
        commands(3.0, 0.02, 1, [&](double t, int) { return from + (to - from) * std::min(t / 3.0, 1.0); });
    return VectorXd(joint1(cell, e, "i1"));
  };
  // Torque of a slow motion: that of the weight on the way up, less by the friction on the way down.
  const VectorXd up = moved(-0.1, 0.1), down = moved(0.1, -0.1);
  const Eigen::Index middle = up.size() / 2;
  CHECK(up.segment(middle - 10, 20).mean() == Approx(weight).epsilon(0.02));
  CHECK(down.segment(middle - 10, 20).mean() == Approx(0.5 * weight).epsilon(0.02));
  // Half the weight holds it, for friction bears the other half; less does not.
  for (const double share : {0.55, 0.45}) {
    servo(cell) = {.stiffness = 200.0, .damping = 1.0, .torque_limit = share * weight};
    const VectorXd q = joint1(cell, commands(1.0, 0.02, 1, [](double, int) { return 0.0; }));
    CHECK((std::abs(last(q)) < 0.01) == (share > 0.5));
  }
}

TEST_CASE("dry friction that depends on the angle holds a joint at one and not at another") {
  cell::Cell cell = pendulum();
  cell.robot.gravity.setZero();
  cell.drives->friction.coulomb[0] = 0.3;
  for (const auto& [name, value] : {std::pair{"amplitude", 0.2}, {"cycles", 1.0}, {"phase", 0.0}})
    cell::set_effect(cell, "angle_friction", "joint1", name, value);
  for (const double side : {1.0, -1.0}) {  // 0.5 N m about one angle, 0.1 N m about the other
    const double at = 0.5 * M_PI * side, pull = 0.3 / servo(cell).stiffness;
    const VectorXd q = joint1(cell, commands(3.0, 0.02, 1, [&](double t, int) { return at + (t < 1.0 ? 0.0 : pull); }));
    CHECK((std::abs(last(q) - at) < 1e-12) == (side > 0));
  }
}

TEST_CASE("a drive with a dead band leaves a joint where less than that is asked, and the integral overcomes it") {
  cell::Cell cell = pendulum();
  cell.robot.gravity.setZero();
  cell.drives->friction.coulomb[0] = 0.02;  // it does not coast through the band
  servo(cell).torque_dead_band = 0.3;
  const double edge = 0.3 / servo(cell).stiffness;
  const auto step_to = [](double to) {
    return commands(6.0, 0.02, 1, [to](double t, int) { return t < 1.0 ? 0.0 : to; });
  };
  CHECK(joint1(cell, step_to(0.95 * edge)).cwiseAbs().maxCoeff() == 0.0);
  CHECK(last(joint1(cell, commands(5.0, 0.02, 1, [](double t, int) { return std::min(0.03 * t, 0.1); }))) ==
        Approx(0.1 - edge).margin(4e-3));
  servo(cell).integral = 20.0;
  CHECK(last(joint1(cell, step_to(0.95 * edge))) > 0.5 * edge);
}

TEST_CASE("a lower supply voltage lets a joint turn less fast, in proportion") {
  cell::Cell cell = pendulum();
  cell.robot.gravity.setZero();
  servo(cell) = {.stiffness = 15.0, .damping = 0.0, .stall_torque = 1.0, .no_load_speed = 2.0};
  cell::set_effect(cell, "servo_voltage", "joint1", "voltage", 0.7);
  const VectorXd q = joint1(cell, commands(1.5, 0.02, 1, [](double t, int) { return t < 0.1 ? 0.0 : 6.0; }));
  const Eigen::Index n = q.size();
  CHECK((q[n - 1] - q[n - 11]) / 0.2 == Approx(1.4).epsilon(1e-3));
}

TEST_CASE("a delay moves the whole motion, by any part of a row") {
  cell::Cell cell = pendulum();
  servo(cell).hold = cell::CommandHold::FirstOrderHold;
  const cell::Experiment e = commands(4.0, 0.01, 1, swing);
  const VectorXd prompt = joint1(cell, e);
  servo(cell).delay = 0.04;
  const VectorXd late = joint1(cell, e);
  CHECK((late.tail(300) - prompt.segment(prompt.size() - 304, 300)).cwiseAbs().maxCoeff() < 1e-3);
  servo(cell).delay = 0.041;  // smooth in the delay
  const VectorXd later = joint1(cell, e);
  CHECK((later - late).cwiseAbs().maxCoeff() < 2e-3);
  CHECK((later - late).cwiseAbs().maxCoeff() > 1e-4);
}

TEST_CASE("coupled joints do not depend on the rate of their log, with and without dry friction") {
  for (const double coulomb : {0.0, 0.1}) {
    cell::Cell cell = pendulum(3);
    servo(cell).hold = cell::CommandHold::FirstOrderHold;
    cell.drives->friction.coulomb.setConstant(coulomb);
    const auto wave = [](double t, int j) { return t < 0.2 ? 0.0 : 0.3 * std::sin((1.0 + 0.7 * j) * (t - 0.2)); };
    const VectorXd coarse = joint1(cell, commands(5.0, 0.02, 3, wave), "q2");
    const VectorXd fine = joint1(cell, commands(5.0, 0.002, 3, wave), "q2");
    double off = 0.0;
    for (Eigen::Index k = 0; k < coarse.size(); ++k) off = std::max(off, std::abs(coarse[k] - fine[10 * k]));
    INFO("dry friction " << coulomb << " N m");
    CHECK(off < 2e-3);
  }
}

TEST_CASE("light joints on stiff servos need no finer steps than their motion") {
  cell::Cell cell = pendulum(3);
  cell.drives->rotor_inertia.setConstant(1e-5);
  cell.robot.links[2].mass = 0.01;
  for (const double damping : {0.05, 2.0, 50.0}) {
    cell.servo->torque = {{.stiffness = 900.0, .damping = damping}};
    servo(cell).hold = cell::CommandHold::FirstOrderHold;
    for (const double coulomb : {0.0, 0.2}) {
      cell.drives->friction.coulomb.setConstant(coulomb);
      const auto wave = [](double t, int j) { return t < 0.2 ? 0.0 : 0.3 * std::sin((1.0 + 0.7 * j) * (t - 0.2)); };
      const cell::Experiment coarse = commands(4.0, 0.02, 3, wave), fine = commands(4.0, 0.0005, 3, wave);
      for (const char* column : {"q1", "q2", "q3"}) {
        INFO(column << " with damping " << damping << " N m s/rad, dry friction " << coulomb << " N m");
        const VectorXd shown = joint1(cell, coarse, column), expected = joint1(cell, fine, column);
        const double off = damping < 1.0 ? 2e-3 : 5e-4;  // 0.3 rad/s swings by 1.3 mrad where hardly damped
        for (Eigen::Index k = 0; k < shown.size(); ++k) REQUIRE(std::abs(shown[k] - expected[40 * k]) < off);
      }
    }
  }
}

/// The same commands with a gain of the servos in each row.
cell::Experiment with_gain(cell::Experiment e, const std::function<double(double)>& gain) {
  const Eigen::Index rows = e.data.values.rows(), columns = e.data.values.cols();
  e.data.columns.emplace_back(cell::servo_gain_column);
  e.data.values.conservativeResize(rows, columns + 1);
  for (Eigen::Index k = 0; k < rows; ++k) e.data.values(k, columns) = gain(e.data.values(k, 0));
  return e;
}

TEST_CASE("a gain of the servos in an experiment is a factor on their stiffness") {
  const cell::Cell arm = pendulum(2);
  cell::Cell stiffer = arm;
  servo(stiffer).stiffness *= 2.5;
  const cell::Experiment e = commands(3.0, 0.02, 2, swing);
  const VectorXd found = joint1(arm, with_gain(e, [](double) { return 2.5; }));
  CHECK((found - joint1(stiffer, e)).cwiseAbs().maxCoeff() < 1e-9);
  CHECK((joint1(arm, with_gain(e, [](double) { return 1.0; })) - joint1(arm, e)).cwiseAbs().maxCoeff() == 0.0);
}

TEST_CASE("an arm whose motors are switched off swings by its weight alone") {
  cell::Cell arm = pendulum();
  arm.robot.gravity = {gravity, 0.0, 0.0};  // hangs along x at 0
  const cell::Experiment e = commands(4.0, 0.005, 1, [](double, int) { return 0.1; });
  const VectorXd found = joint1(arm, with_gain(e, [](double t) { return t < 1.0 ? 1.0 : 0.0; }));
  const VectorXd t = e.data.column("t");
  const double at = found[200], rate = std::sqrt(gravity * arm_length * mass / inertia);  // small swings from rest
  for (Eigen::Index k = 200; k < t.size(); ++k) CHECK(std::abs(found[k] - at * std::cos(rate * (t[k] - 1.0))) < 2e-3);
  CHECK_THROWS_WITH(joint1(arm, with_gain(e, [](double) { return -1.0; })), Contains("servo_gain"));
}

TEST_CASE("a motion begins where it was measured") {
  const cell::Cell cell = pendulum();
  cell::Experiment e = commands(1.0, 0.02, 1, [](double, int) { return 0.4; });
  e.data.columns.push_back("q1");
  e.data.values.conservativeResize(Eigen::NoChange, 3);
  e.data.values.col(2).setConstant(-0.2);
  CHECK(joint1(cell, e)[0] == -0.2);
}

TEST_CASE("what cannot be moved by a torque servo is refused by name") {
  const cell::Experiment e = commands(1.0, 0.02, 1, swing);
  cell::Cell cell = pendulum();
  cell.robot.links.front().mass = 0.0;
  cell.drives->rotor_inertia.setZero();
  CHECK_THROWS_WITH(joint1(cell, e), Contains("drives.rotor_inertia") && Contains("joint 1"));
  cell = pendulum();
  cell.robot.links.clear();
  CHECK_THROWS_WITH(joint1(cell, e), Contains("robot.links"));
}

TEST_CASE("every effect of torque servos changes the motion, and has its place in the cell") {
  const cell::Experiment e = commands(4.0, 0.02, 1, swing);
  cell::Cell nominal = pendulum();
  servo(nominal).stall_torque = 1.5;
  servo(nominal).no_load_speed = 4.0;
  const VectorXd before = joint1(nominal, e);
  int count = 0;
  for (const cell::Effect& effect : cell::effect_catalogue()) {
    const bool of_servo = effect.needs.part.starts_with("torque servo") || effect.id == "servo_voltage";
    if (!of_servo && effect.id != "joint_delay") continue;
    ++count;
    INFO(effect.id);
    cell::Cell cell = nominal;
    const std::string target = cell::effect_targets(effect, cell).at(0);
    const cell::EffectParameter& p = effect.parameters.at(0);
    const auto off = cell::nominal_value(cell, effect.id, target, p.name);
    const double value = off ? std::get<double>(*off) : 0.0;
    const double lower = p.unit == "N m/rad" ? -5.0 : p.unit == "-" ? -0.5 : 0.03;
    cell::set_effect(cell, effect.id, target, p.name, std::isinf(value) ? 0.6 : value + lower);
    const VectorXd after = joint1(cell, e);
    CHECK((after - before).cwiseAbs().maxCoeff() > 1e-4);
    const physics::FoldedCell folded = physics::fold_effects(cell);
    CHECK(folded.remaining.empty());
    CHECK(cell::active_effects(folded.cell.effects).empty());
    CHECK((joint1(folded.cell, e) - after).cwiseAbs().maxCoeff() < 1e-12);
  }
  CHECK(count == 8);
}

TEST_CASE("play and elastic gears are no effects of a cell with torque servos") {
  cell::Cell cell = pendulum();
  for (const char* id : {"backlash", "joint_elasticity"}) {
    CHECK_FALSE(cell::effect_possible(cell::find_effect(id), cell, "joint1"));
  }
}

}  // namespace servo_arm_test
