#include "gap/reporting/untried_effects.hpp"

#include <algorithm>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>

#include "gap/linear_world.hpp"

namespace untried_effects_test {

using namespace kr5;

namespace {

const gap::UntriedEffect* of(const std::vector<gap::UntriedEffect>& all, const std::string& effect) {
  const auto found = std::ranges::find(all, effect, &gap::UntriedEffect::effect);
  return found == all.end() ? nullptr : &*found;
}

}  // namespace

TEST_CASE("effects of parts that a cell lacks are untried, and those that no column shows, target by target") {
  cell::Cell cell = linear_world::unit_noise();
  // The shipped cell has every part, but for torque servos, in whose place its joint servos stand.
  CHECK(gap::untried_effects(cell, {}).empty());
  cell.camera.reset();
  const std::vector<gap::EffectName> unseen = {{"ft_bias", "fx"}, {"ft_bias", "tz"}, {"laser_bias", "laser"}};
  const std::vector<gap::UntriedEffect> found = gap::untried_effects(cell, unseen);
  REQUIRE(of(found, "hand_eye"));
  CHECK(of(found, "hand_eye")->targets.empty());
  CHECK(of(found, "hand_eye")->reason == gap::NotTried::PartMissing);
  CHECK(of(found, "hand_eye")->part == "camera");
  REQUIRE(of(found, "ft_bias"));
  CHECK(of(found, "ft_bias")->reason == gap::NotTried::NotRecorded);
  CHECK(of(found, "ft_bias")->targets == std::vector<std::string>{"fx", "tz"});
  REQUIRE(of(found, "laser_bias"));
  CHECK(of(found, "laser_bias")->targets.empty());  // on none of its targets
  CHECK_FALSE(of(found, "coulomb_friction"));
  // In the order of the catalogue.
  std::vector<std::string> order;
  for (const cell::Effect& e : cell::effect_catalogue())
    if (of(found, e.id)) order.push_back(e.id);
  REQUIRE(order.size() == found.size());
  for (std::size_t k = 0; k < order.size(); ++k) CHECK(found[k].effect == order[k]);
}

TEST_CASE("servos of one kind stand in the place of the other; without any, both are missing") {
  cell::Cell cell = linear_world::unit_noise();
  cell.servo->joint.clear();
  const std::vector<gap::UntriedEffect> without = gap::untried_effects(cell, {});
  for (const char* effect : {"servo_stiffness", "servo_voltage", "joint_servo", "joint_delay"}) {
    INFO(effect);
    REQUIRE(of(without, effect));
    CHECK(of(without, effect)->reason == gap::NotTried::PartMissing);
  }
  cell.servo->torque = {{.stiffness = 20.0, .damping = 1.0}};
  const std::vector<gap::UntriedEffect> driven = gap::untried_effects(cell, {});
  CHECK_FALSE(of(driven, "servo_stiffness"));
  CHECK_FALSE(of(driven, "joint_servo"));
  REQUIRE(of(driven, "servo_voltage"));  // no limit by voltage is stated
  CHECK(of(driven, "servo_voltage")->part == "limit by the supply voltage (servo.torque: stall_torque, no_load_speed)");
  REQUIRE(of(driven, "backlash"));  // which no servo replaces
}

}  // namespace untried_effects_test
