#include "gap/screening/row_hypothesis.hpp"

#include <cmath>
#include <map>
#include <set>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// Rows of the catalogue as hypotheses, against what the kinds of coordinates stand for.

namespace row_hypothesis_test {

using namespace kr5;

namespace {

const cell::Cell& shipped() {
  static const cell::Cell cell = linear_world::unit_noise();
  return cell;
}

std::vector<gap::Hypothesis> rows(const std::string& effect, const std::string& target, int index, int cycles = 1) {
  return gap::row_hypotheses(cell::find_effect(effect), {shipped(), index, 0, 0.0, 100.0}, target, cycles);
}

cell::EffectValue value(const gap::Hypothesis& h, const std::string& parameter, const Eigen::VectorXd& x) {
  cell::Cell c = shipped();
  h.apply(c, x);
  const auto out = cell::get_effect(c.effects, h.effect, h.target, parameter);
  REQUIRE(out);
  return *out;
}

double number(const gap::Hypothesis& h, const std::string& parameter, double x) {
  return std::get<double>(value(h, parameter, Eigen::VectorXd::Constant(1, x)));
}

}  // namespace

TEST_CASE("each kind of coordinate is the function of x that its name says") {
  const gap::Hypothesis offset = rows("encoder_offset", "joint2", 1).front();
  const double size = number(offset, "offset", 1.0);
  CHECK(size != 0.0);
  CHECK(number(offset, "offset", -2.5) == Approx(-2.5 * size));  // linear
  const gap::Hypothesis friction = rows("coulomb_friction", "joint2", 1).front();
  const double nominal = shipped().drives->friction.coulomb(1);
  CHECK(number(friction, "coulomb", 0.0) == Approx(nominal));  // linear, about the nominal value
  CHECK(number(friction, "coulomb", 2.0) - nominal == Approx(2 * (number(friction, "coulomb", 1.0) - nominal)));
  CHECK(friction.coordinates[0].lower == Approx(-nominal / (number(friction, "coulomb", 1.0) - nominal)));
  const gap::Hypothesis spring = rows("joint_elasticity", "joint2", 1).front();
  CHECK(number(spring, "stiffness", 0.25) == Approx(4 * number(spring, "stiffness", 1.0)));  // reciprocal
  CHECK(spring.coordinates[0].lower == 0.0);
  const gap::Hypothesis servo = rows("joint_servo", "joint2", 1).front();
  const double one = number(servo, "natural_frequency", 1.0), off = number(servo, "natural_frequency", 0.0);
  CHECK(number(servo, "natural_frequency", 3.0) == Approx(off * std::pow(one / off, 3)));  // a ratio
}

TEST_CASE("a ripple has an amplitude and a phase from the coefficients of sine and cosine") {
  const gap::Hypothesis ripple = rows("torque_ripple", "joint3", 2, 12).front();
  REQUIRE(ripple.coordinates.size() == 2);
  CHECK(ripple.choice == "12 cycles");
  const Eigen::Vector2d x(0.6, 0.8);
  const double size = std::get<double>(value(ripple, "amplitude", Eigen::Vector2d(1.0, 0.0)));
  CHECK(std::get<double>(value(ripple, "amplitude", x)) == Approx(size));
  CHECK(std::get<double>(value(ripple, "phase", x)) == Approx(std::atan2(0.8, 0.6)));
  CHECK(ripple.probes.front().indivisible);
}

TEST_CASE("a mount moves by what its six coordinates say, from the nominal pose") {
  const gap::Hypothesis mount = rows("hand_eye", "camera", 0).front();
  REQUIRE(mount.coordinates.size() == 6);
  std::string pose;
  for (const cell::EffectParameter& p : cell::find_effect("hand_eye").parameters)
    if (p.kind == cell::EffectValueKind::Pose) pose = p.name;
  const auto at = [&](const Eigen::VectorXd& x) { return std::get<Pose>(value(mount, pose, x)); };
  const Pose nominal = at(Eigen::VectorXd::Zero(6));
  const double size = (nominal.inverse() * at(Eigen::VectorXd::Unit(6, 0))).translation().x();
  CHECK(size > 0.0);
  Eigen::VectorXd x(6);
  x << 1, -2, 3, -1, 2, 1;
  const Pose moved = nominal.inverse() * at(x);
  CHECK((moved.translation() - size * x.head<3>()).norm() < 1e-12);
  const Eigen::AngleAxisd turn(moved.rotation());
  CHECK((turn.angle() * turn.axis() - size * x.tail<3>()).norm() < 1e-9);
}

TEST_CASE("hypotheses of one effect are its choices, each as likely") {
  for (const cell::Effect& effect : cell::effect_catalogue()) {
    const std::vector<std::string> targets = cell::effect_targets(effect, shipped());
    if (targets.empty() || !cell::effect_possible(effect, shipped(), targets[0])) continue;
    CAPTURE(effect.id);
    const std::vector<gap::Hypothesis> all = rows(effect.id, targets[0], 0);
    double sum = 0.0;
    std::set<std::string> choices;
    for (const gap::Hypothesis& h : all) {
      sum += std::exp(h.log_prior);
      choices.insert(h.choice);
      CHECK(h.effect == effect.id);
      CHECK(h.inaccuracy == effect.inaccuracy);
      REQUIRE(h.size() > 0);
      for (const gap::Coordinate& c : h.coordinates) CHECK(c.lower < c.upper);
      for (const gap::Probe& probe : h.probes)
        for (const Eigen::VectorXd& x : probe.points) {
          REQUIRE(x.size() == h.size());
          cell::Cell c = shipped();
          h.apply(c, x);
          CHECK_FALSE(cell::active_effects(c.effects).empty());  // every point of a signature switches it on
        }
    }
    CHECK(sum == Approx(1.0));
    CHECK(choices.size() == all.size());
  }
}

TEST_CASE("an optional parameter is tried with and without, and one that fades over time at several times") {
  const std::vector<gap::Hypothesis> payload = rows("payload", "tool", 0);
  REQUIRE(payload.size() == 2);
  CHECK(payload[0].choice.empty());
  CHECK(payload[1].choice == "with inertia");
  CHECK(payload[1].size() == payload[0].size() + 1);
  const gap::Hypothesis warming = rows("thermal_friction", "joint1", 0).front();
  REQUIRE(warming.size() == 2);
  CHECK(warming.coordinates[1].shape);
  CHECK(warming.probes.size() > 2);
  std::set<double> times;
  for (const gap::Probe& probe : warming.probes) {
    CHECK(probe.points[0](0) == 1.0);
    times.insert(std::get<double>(value(warming, "time_constant", probe.points[0])));
  }
  CHECK(times.size() == warming.probes.size());
}

}  // namespace row_hypothesis_test
