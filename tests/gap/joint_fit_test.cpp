#include <kr5/gap/joint_fit.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "gap/protocol.hpp"

namespace joint_fit_test {

using namespace kr5;
using Catch::Contains;

namespace {

cell::Recording motions(const cell::Cell& cell, std::uint64_t seed) {
  Random random(seed);
  return protocol::only(protocol::record(cell, random), cell::Kind::Motion);
}

const gap::FittedEffect& effect_of(const gap::JointFit& fit, const std::string& effect, const std::string& target) {
  for (const gap::FittedEffect& e : fit.effects)
    if (e.effect == effect && e.target == target) return e;
  throw InvalidArgument("no such effect");
}

}  // namespace

TEST_CASE("friction of one joint is found among all, however far off, and the others stay") {
  const cell::Cell broken = protocol::carrying("coulomb_friction", "joint3", "coulomb", 60.0);
  const cell::Recording recording = motions(broken, 31);
  std::vector<double> told;
  gap::JointFitOptions options{.effects = {"coulomb_friction", "viscous_friction"}, .progress = {}};
  options.threads = 1;
  options.progress = [&](double fraction) { told.push_back(fraction); };
  const gap::JointFit fit = gap::fit_joint_effects(recording, predict::FastSimulator(), options);
  REQUIRE(fit.effects.size() == 12);
  REQUIRE(fit.covariance.rows() == 12);
  int inside = 0;
  for (const gap::FittedEffect& e : fit.effects) {
    CHECK(e.determined);
    const gap::ParameterEstimate& p = e.parameters.front();
    const int joint = e.target.back() - '1';
    const auto& friction = recording.cell.drives->friction;
    double truth = e.effect == "coulomb_friction" ? friction.coulomb[joint] : friction.viscous[joint];
    if (e.effect == "coulomb_friction" && e.target == "joint3") truth = 60.0;
    CHECK(std::abs(p.value[0] - truth) < 6 * p.std[0]);
    inside += std::abs(p.value[0] - truth) < 2 * p.std[0];
  }
  CHECK(inside >= 8);
  const gap::FittedEffect& found = effect_of(fit, "coulomb_friction", "joint3");
  CHECK(found.parameters.front().value[0] == Approx(60.0).epsilon(0.05));
  for (const gap::ColumnFit& column : fit.columns) {
    CHECK(column.after < 1.3 * column.noise);
    CHECK(column.check_after < 1.3 * column.noise);
  }
  CHECK(std::ranges::is_sorted(told));
  CHECK(told.back() == 1.0);
}

TEST_CASE("what the model cannot show of one motion costs the others nothing") {
  const cell::Recording clean = motions(protocol::carrying("coulomb_friction", "joint2", "coulomb", 20.0), 33);
  cell::Recording disturbed = clean;
  int to_fit = 0;
  for (cell::Experiment& e : disturbed.experiments)
    if (e.split == cell::Split::Fit && to_fit++ == 0) {
      const int column = e.data.find("i2");
      REQUIRE(column >= 0);
      const double sigma = disturbed.cell.noise.of("current", 1);
      for (Eigen::Index row = 0; row < e.data.values.rows(); ++row)
        e.data.values(row, column) += 50.0 * sigma * std::sin(0.7 * static_cast<double>(row));
    }
  REQUIRE(to_fit > 1);
  const auto friction = [](const cell::Recording& recording) {
    const gap::JointFit fit = gap::fit_joint_effects(
        recording, predict::FastSimulator(), {.effects = {"coulomb_friction", "viscous_friction"}, .progress = {}});
    return effect_of(fit, "coulomb_friction", "joint2").parameters.front();
  };
  const gap::ParameterEstimate alone = friction(clean), beside = friction(disturbed);
  CHECK(std::abs(beside.value[0] - 20.0) < 4 * beside.std[0]);
  CHECK(beside.std[0] < 2.5 * alone.std[0]);  // of two or more motions one is lost
}

TEST_CASE("effects that cannot be fitted to all joints are refused by name") {
  const cell::Recording recording = motions(protocol::carrying("coulomb_friction", "joint3", "coulomb", 9.0), 32);
  const predict::FastSimulator simulator;
  const auto fit = [&](std::vector<std::string> effects) {
    return gap::fit_joint_effects(recording, simulator, {.effects = std::move(effects), .progress = {}});
  };
  CHECK_THROWS_WITH(fit({}), Contains("effects"));
  CHECK_THROWS_WITH(fit({"no_such_effect"}), Contains("no_such_effect"));
  CHECK_THROWS_WITH(fit({"torque_ripple"}), Contains("none of them") || Contains("several parameters"));
  CHECK_THROWS_WITH(fit({"servo_stiffness"}), Contains("none of them"));
}

}  // namespace joint_fit_test
