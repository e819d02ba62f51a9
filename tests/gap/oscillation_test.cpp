#include "gap/reporting/oscillation.hpp"

#include <cmath>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// The one oscillation that makes up most of a column.

namespace oscillation_test {

using namespace kr5;
using namespace linear_world;

namespace {

constexpr double level = 0.005;

/// Two motions, each with a wave of its own phase, and noise of 1.
std::vector<cell::Experiment> waves(double amplitude, double frequency, double drift = 0.0, std::uint64_t seed = 81) {
  Random random(seed);
  std::vector<cell::Experiment> out = {motion("motion-1", cell::Split::Fit, 500),
                                       motion("motion-2", cell::Split::Check, 400, 30.0)};
  double phase = 0.4;
  for (cell::Experiment& e : out) {
    add_column(e, "i1", random.normal_vector(e.data.values.rows()) + at_times(e, [&](double t) {
                          return amplitude * std::sin(2 * M_PI * frequency * t + phase) + drift * std::fmod(t, 30.0);
                        }));
    phase += 2.0;
  }
  return out;
}

std::optional<gap::Dependence> oscillation(const World& world) {
  return gap::main_oscillation(world.data, gap::make_groups(world.data).front(), world.base, level);
}

}  // namespace

TEST_CASE("the period of an oscillation is found, whatever its phase in each experiment") {
  for (const double frequency : {0.7, 2.37, 11.0}) {
    const World world(waves(2.0, frequency));
    const auto found = oscillation(world);
    REQUIRE(found);
    CHECK(gap::symbol(found->variable) == "t");
    CHECK(found->shape == gap::Shape::Oscillates);
    CHECK(found->period == Approx(1 / frequency).epsilon(0.015));
    CHECK(found->evidence > 1 - level);
    CHECK(found->share > 0.9);
  }
}

TEST_CASE("noise has no main oscillation, and a drift that outweighs one leaves it out") {
  int found = 0;
  for (std::uint64_t seed = 100; seed < 140; ++seed) {
    const World world(waves(0.0, 1.0, 0.0, seed));
    found += oscillation(world).has_value();
  }
  CHECK(found <= 2);  // 40 trials of 0.005: beyond with probability 0.001
  CHECK_FALSE(oscillation(World(waves(1.0, 2.0, 3.0))));
  CHECK(oscillation(World(waves(1.0, 2.0, 0.02))));
}

TEST_CASE("spikes are left out, and without a clock or enough rows there is none") {
  World world(waves(2.0, 2.37));
  for (const Eigen::Index i : {20, 21, 250, 700}) {
    world.base(i) = 0.0;
    world.data.use(i) = 0.0;
  }
  const auto found = oscillation(world);
  REQUIRE(found);
  CHECK(found->period == Approx(1 / 2.37).epsilon(0.015));
  std::vector<cell::Experiment> brief = waves(20.0, 11.0);
  for (cell::Experiment& e : brief) e.data.values.conservativeResize(15, Eigen::NoChange);
  CHECK_FALSE(oscillation(World(brief)));
  World no_clock(waves(2.0, 2.37));
  for (cell::Experiment& e : no_clock.recording.experiments) e.data.columns[0] = "time";
  CHECK_FALSE(oscillation(no_clock));
}

}  // namespace oscillation_test
