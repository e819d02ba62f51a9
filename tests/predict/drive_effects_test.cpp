#include <catch2/catch.hpp>

#include <kr5/kinematics/newton_euler.hpp>

#include "predict/world.hpp"

namespace drive_effects_test {

using namespace kr5;
using namespace kr5::test;
using cell::Kind;
using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// Torque on the joint side that an effect adds to joint 1, 2 or 3, whose motors move nothing else.
VectorXd added_torque(const World& before, const World& after, int joint) {
  const std::string column = "i" + std::to_string(joint + 1);
  const cell::Drives& d = *before.cell.drives;
  return (after.show(Kind::Motion, column) - before.show(Kind::Motion, column)) * d.torque_constant[joint] *
         d.structure(joint, joint);
}

/// Rows in which a joint is surely moving.
std::vector<Index> moving(const VectorXd& speed, double least = 0.05) {
  std::vector<Index> out;
  for (Index k = 0; k < speed.size(); ++k)
    if (std::abs(speed[k]) > least) out.push_back(k);
  REQUIRE(out.size() > 100);
  return out;
}

VectorXd posture(const World& w, Index row) {
  VectorXd q(6);
  for (int i = 0; i < 6; ++i) q[i] = w.of(Kind::Poses).data.column("q" + std::to_string(i + 1))[row];
  return q;
}

kinematics::Dynamics dynamics(const cell::Cell& c) {
  kinematics::Dynamics arm(cell::nominal_chain(c), c.robot.links, c.robot.gravity);
  arm.add_body(5, {c.tool->mass, c.tool->com, c.tool->inertia}, c.tool->T_flange_sensor);
  return arm;
}

VectorXd gravity_torques(const cell::Cell& c, const VectorXd& q) { return dynamics(c).gravity_torques(q); }

/// Mean period of what swings about 0.
double period(const VectorXd& t, const VectorXd& x) {
  std::vector<double> crossings;
  for (Index k = 1; k < x.size(); ++k)
    if (x[k - 1] < 0 && x[k] >= 0) crossings.push_back(t[k] - (t[k] - t[k - 1]) * x[k] / (x[k] - x[k - 1]));
  REQUIRE(crossings.size() >= 5);
  return (crossings.back() - crossings.front()) / static_cast<double>(crossings.size() - 1);
}

/// A world whose drives have neither friction nor rotors, so that the current of joint 3 shows the torque through its
/// gear.
struct LoadedWorld : World {
  LoadedWorld() {
    cell.drives->friction.coulomb.setZero();
    cell.drives->friction.viscous.setZero();
    cell.drives->rotor_inertia.setZero();
    speed = rate_of(show(Kind::Motion, "q3"));
    load = show(Kind::Motion, "i3") * cell.drives->torque_constant[2] * cell.drives->structure(2, 2);
  }

  VectorXd speed, load;
};

}  // namespace

TEST_CASE("more Coulomb friction is a step at every reversal") {
  const World w;
  const VectorXd speed = rate_of(w.show(Kind::Motion, "q2"));
  const VectorXd torque = added_torque(w, w.with("coulomb_friction", "joint2", {{"coulomb", 52.0}}), 1);
  for (const Index k : moving(speed)) CHECK(torque[k] == Approx(std::copysign(12.0, speed[k])).margin(1e-9));
}

TEST_CASE("more viscous friction is proportional to speed") {
  const World w;
  const VectorXd speed = rate_of(w.show(Kind::Motion, "q2"));
  const VectorXd torque = added_torque(w, w.with("viscous_friction", "joint2", {{"viscous", 92.0}}), 1);
  for (const Index k : moving(speed)) CHECK(torque[k] == Approx(20.0 * speed[k]).margin(1e-3));
}

TEST_CASE("Stribeck friction shows near zero speed only") {
  const World w;
  const VectorXd speed = rate_of(w.show(Kind::Motion, "q2"));
  const VectorXd torque =
      added_torque(w, w.with("stribeck_friction", "joint2", {{"stribeck", 20.0}, {"stribeck_velocity", 0.04}}), 1);
  CHECK(torque.cwiseAbs().maxCoeff() > 15.0);
  for (const Index k : moving(speed, 0.01))
    CHECK(torque[k] == Approx(std::copysign(20.0 * std::exp(-std::pow(speed[k] / 0.04, 2)), speed[k])).margin(0.01));
}

TEST_CASE("load friction is a part of the transmitted torque, against the motion") {
  const LoadedWorld w;
  const VectorXd torque = added_torque(w, w.with("load_friction", "joint3", {{"coefficient", 0.07}}), 2);
  for (const Index k : moving(w.speed))
    CHECK(torque[k] == Approx(std::copysign(0.07 * std::abs(w.load[k]), w.speed[k])).margin(1e-9));
}

TEST_CASE("friction while the load drives is a part of the transmitted torque, where power flows to the motor") {
  const LoadedWorld w;
  const VectorXd torque = added_torque(w, w.with("driven_friction", "joint3", {{"coefficient", 0.2}}), 2);
  int driven = 0;
  for (const Index k : moving(w.speed)) {
    const bool back = w.load[k] * w.speed[k] < 0.0;
    driven += back;
    CHECK(torque[k] == Approx(back ? -0.2 * w.load[k] : 0.0).margin(1e-9));
  }
  CHECK(driven > 50);
}

TEST_CASE("drag grows with the square of the speed, against it") {
  const World w;
  const VectorXd speed = rate_of(w.show(Kind::Motion, "q2"));
  const VectorXd torque = added_torque(w, w.with("quadratic_drag", "joint2", {{"quadratic", 30.0}}), 1);
  for (const Index k : moving(speed)) CHECK(torque[k] == Approx(30.0 * speed[k] * std::abs(speed[k])).margin(2e-3));
}

TEST_CASE("friction that depends on the angle is a step at a reversal as high as the angle says") {
  const World w;
  const VectorXd q = w.show(Kind::Motion, "q2"), speed = rate_of(q);
  const VectorXd torque =
      added_torque(w, w.with("angle_friction", "joint2", {{"amplitude", 8.0}, {"cycles", 5.0}, {"phase", 0.4}}), 1);
  for (const Index k : moving(speed))
    CHECK(torque[k] == Approx(std::copysign(8.0, speed[k]) * std::sin(5.0 * q[k] + 0.4)).margin(1e-9));
}

TEST_CASE("friction falls by the stated part as the gear warms") {
  World w, free;
  free.cell.drives->friction.coulomb.setZero();
  free.cell.drives->friction.viscous.setZero();
  const World warm = w.with("thermal_friction", "joint1", {{"drop", 0.4}, {"time_constant", 60.0}});
  const VectorXd t = w.of(Kind::Motion).data.column("t");
  const VectorXd cold = added_torque(free, w, 0), less = added_torque(free, warm, 0);
  for (const Index k : moving(rate_of(w.show(Kind::Motion, "q1"))))
    CHECK(less[k] / cold[k] == Approx(1.0 - 0.4 * (1.0 - std::exp(-t[k] / 60.0))));
}

TEST_CASE("an elastic joint sags by gravity torque over stiffness, and does so less the stiffer it is") {
  const World w;
  for (const double stiffness : {2e4, 2e5}) {
    const World soft = w.with("joint_elasticity", "joint2", {{"stiffness", stiffness}});
    const io::Table shown = soft.show(Kind::Poses);
    for (Index row = 0; row < shown.values.rows(); ++row) {
      VectorXd q = posture(w, row);
      for (int pass = 0; pass < 20; ++pass) q[1] = posture(w, row)[1] - gravity_torques(w.cell, q)[1] / stiffness;
      CHECK((shown.values.row(row).head<3>().transpose() - cell::T_base_tool(w.cell, q).translation()).norm() < 1e-6);
    }
  }
}

TEST_CASE("an elastic joint rings at the frequency of its link on its spring, unseen by the encoders") {
  World w;
  const VectorXd home = numbers({0.0, 0.02, -2.75, 0.0, -0.3, 1.571});
  std::vector<VectorXd> table;
  for (int k = 0; k < 600; ++k) table.push_back(row({0.002 * k}, home + (k < 20 ? 0.0 : 0.02) * VectorXd::Unit(6, 4)));
  w.of(Kind::Motion) = experiment(Kind::Motion, joined({"t"}, "qc", {}), table);
  for (const double stiffness : {600.0, 2400.0}) {
    const World soft = w.with("joint_elasticity", "joint5", {{"stiffness", stiffness}});
    CHECK(soft.show(Kind::Motion, "q5") == w.show(Kind::Motion, "q5"));
    VectorXd torque = soft.show(Kind::Motion, "ty");
    torque.array() -= torque.tail(30).mean();
    const VectorXd end = home + 0.02 * VectorXd::Unit(6, 4), h = 1e-4 * VectorXd::Unit(6, 4);
    const double gravity = (gravity_torques(w.cell, end + h)[4] - gravity_torques(w.cell, end - h)[4]) / 2e-4;
    const double frequency = std::sqrt((stiffness + gravity) / dynamics(w.cell).mass_matrix(end)(4, 4));
    const double expected = 2 * M_PI / (frequency * std::sqrt(1 - 0.06 * 0.06));
    // Rows after the servo has come to rest and before the ringing has.
    CHECK(period(w.of(Kind::Motion).data.column("t").segment(175, 320), torque.segment(175, 320)) ==
          Approx(expected).epsilon(0.005));
  }
}

TEST_CASE("a link with backlash lies at the side to which gravity pushes it") {
  const World w;
  const io::Table shown = w.with("backlash", "joint2", {{"gap", 0.003}}).show(Kind::Poses);
  for (Index row = 0; row < shown.values.rows(); ++row) {
    VectorXd q = posture(w, row);
    const double torque = gravity_torques(w.cell, q)[1];
    REQUIRE(std::abs(torque) > 0.5);
    q[1] -= std::copysign(0.0015, torque);
    CHECK((shown.values.row(row).head<3>().transpose() - cell::T_base_tool(w.cell, q).translation()).norm() < 1e-12);
  }
}

TEST_CASE("backlash shows as blows in the wrench where the load changes its side") {
  const World w;
  const VectorXd blow = w.with("backlash", "joint1", {{"gap", 0.0025}}).show(Kind::Motion, "fx") -
                        w.show(Kind::Motion, "fx");  // nothing but inertia loads joint 1
  std::vector<double> size(blow.data(), blow.data() + blow.size());
  for (double& s : size) s = std::abs(s);
  std::sort(size.begin(), size.end());
  CHECK(size.back() > 20 * size[size.size() / 2]);
}

TEST_CASE("another torque constant scales the current of its motor") {
  const World w;
  const double nominal = w.cell.drives->torque_constant[4];
  const World other = w.with("torque_constant", "joint5", {{"torque_constant", 1.1 * nominal}});
  CHECK((1.1 * other.show(Kind::Motion, "i5") - w.show(Kind::Motion, "i5")).cwiseAbs().maxCoeff() < 1e-12);
}

TEST_CASE("more rotor inertia shows in proportion to acceleration") {
  const World w;
  const double more = 0.002, S = w.cell.drives->structure(0, 0);
  const VectorXd torque = added_torque(
      w, w.with("rotor_inertia", "joint1", {{"rotor_inertia", w.cell.drives->rotor_inertia[0] + more}}), 0);
  const VectorXd acceleration = rate_of(rate_of(w.show(Kind::Motion, "q1")));
  for (Index k = 40; k < acceleration.size() - 4; ++k)
    CHECK(torque[k] == Approx(more * S * S * acceleration[k]).margin(0.05));
}

TEST_CASE("the dress pack pulls towards its rest") {
  const World w;
  const VectorXd q = w.show(Kind::Motion, "q1");
  const VectorXd torque = added_torque(w, w.with("cable_spring", "joint1", {{"stiffness", 30.0}, {"rest", 0.2}}), 0);
  CHECK((torque - 30.0 * (q.array() - 0.2).matrix()).cwiseAbs().maxCoeff() < 1e-9);
}

TEST_CASE("torque ripple is periodic in the joint angle") {
  const World w;
  const VectorXd q = w.show(Kind::Motion, "q3");
  const World rippled = w.with("torque_ripple", "joint3", {{"amplitude", 2.0}, {"cycles", 24.0}, {"phase", 0.7}});
  CHECK((added_torque(w, rippled, 2) - 2.0 * (24.0 * q.array() + 0.7).sin().matrix()).cwiseAbs().maxCoeff() < 1e-9);
}

TEST_CASE("another coupling of the wrist moves torque between motors, not angles") {
  World w;
  w.cell.drives->rotor_inertia.setZero();
  const World other = w.with("wrist_coupling", "motor5", {{"element", 3.0}, {"value", -2.0}});
  Eigen::MatrixXd S = w.cell.drives->structure;
  const auto torques = [&](const World& of, const Eigen::MatrixXd& structure) {
    Eigen::MatrixXd motor(500, 6);
    for (int i = 0; i < 6; ++i)
      motor.col(i) = of.show(Kind::Motion, "i" + std::to_string(i + 1)) * of.cell.drives->torque_constant[i];
    return Eigen::MatrixXd(motor * structure);
  };
  const Eigen::MatrixXd before = torques(w, S);
  S(4, 3) = -2.0;
  CHECK((torques(other, S) - before).cwiseAbs().maxCoeff() < 1e-9);
  CHECK(other.show(Kind::Motion, "q4") == w.show(Kind::Motion, "q4"));
}

TEST_CASE("currents that are logged late are earlier ones") {
  const World w;
  const VectorXd now = w.show(Kind::Motion, "i2");
  const VectorXd late = w.with("current_delay", "drives", {{"delay", 0.018}}).show(Kind::Motion, "i2");
  for (Index k = 2; k < now.size(); ++k) CHECK(late[k] == Approx((now[k - 1] + now[k - 2]) / 2).margin(1e-9));
  CHECK(late[0] == now[0]);
}

TEST_CASE("a slower axis lags by 2 xi / wn, a later one by its delay") {
  const World w;
  const VectorXd q = w.show(Kind::Motion, "q1"), speed = rate_of(q);
  const auto lag = [&](const World& other) {
    const VectorXd late = q - other.show(Kind::Motion, "q1");
    double sum = 0.0, square = 0.0;
    for (Index k = 100; k < q.size() - 4; ++k) sum += late[k] * speed[k], square += speed[k] * speed[k];
    return sum / square;
  };
  const double xi = w.cell.servo->of_joint(0).damping_ratio;
  CHECK(lag(w.with("joint_servo", "joint1", {{"natural_frequency", 30.0}})) ==
        Approx(2 * xi * (1 / 30.0 - 1 / 45.0)).epsilon(0.02));
  CHECK(lag(w.with("joint_delay", "drives", {{"delay", 0.03}})) == Approx(0.018).epsilon(0.01));
}

}  // namespace drive_effects_test
