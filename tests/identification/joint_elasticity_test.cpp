#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/identification/joint_elasticity.hpp>
#include <kr5/physics/gear_spring.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

namespace joint_elasticity_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using Eigen::Index;
using Eigen::VectorXd;

namespace {

struct SpringTruth {
  double stiffness = 2e4, gap = 0.0, offset = 3e-4;
};

/// Readings of one joint under random loads, by the law of physics.
ElasticityReadings springs(const SpringTruth& truth, Index count, double angle_noise, double torque_noise,
                           std::uint64_t seed, double load = 60.0) {
  Random random(seed);
  const physics::GearSpring gear{.stiffness = truth.stiffness, .gap = truth.gap};
  ElasticityReadings out;
  out.motor.resize(count, 1), out.link.resize(count, 1), out.torque.resize(count, 1);
  for (Index k = 0; k < count; ++k) {
    const double torque = random.uniform(-load, load), link = random.uniform(-2.0, 2.0);
    out.link(k, 0) = link;
    out.motor(k, 0) = link + truth.offset + gear.lead_in_balance(torque) + random.normal(angle_noise);
    out.torque(k, 0) = torque + random.normal(torque_noise);
  }
  return out;
}

}  // namespace

TEST_CASE("readings without noise give stiffness, offset and play of the law") {
  for (const double gap : {0.0, 8e-4}) {
    const ElasticityResult found = identify_elasticity(springs({2e4, gap, -5e-4}, 60, 0.0, 0.0, 1));
    REQUIRE(found.fit.usable());
    const JointSpring& s = found.joints[0];
    CHECK(s.told);
    CHECK(s.stiffness == Approx(2e4).epsilon(1e-9));
    CHECK(s.offset == Approx(-5e-4).epsilon(1e-9));
    CHECK(s.gap == Approx(gap).margin(1e-12));
    CHECK(s.attenuation == 1.0);
  }
}

TEST_CASE("noise of the torques does not make a joint stiffer, as plain least squares does") {
  const double noise = 15.0, load = 60.0, variance = load * load / 3;  // of a uniform load
  ElasticityReadings readings = springs({}, 20000, 1e-4, noise, 2, load);
  const JointSpring plain = identify_elasticity(readings, {.play = false}).joints[0];
  CHECK(plain.stiffness / 2e4 == Approx(1 + noise * noise / variance).epsilon(0.02));
  const JointSpring found =
      identify_elasticity(readings, {.torque_noise = VectorXd::Constant(1, noise), .play = false}).joints[0];
  CHECK(found.stiffness == Approx(2e4).epsilon(0.02));
  CHECK(found.attenuation == Approx(variance / (variance + noise * noise)).epsilon(0.02));
  CHECK(found.torque_spread == Approx(std::sqrt(variance)).epsilon(0.02));
  CHECK(found.stiffness_low < 2e4);
  CHECK(found.stiffness_high > 2e4);
}

TEST_CASE("covariances of a spring hold the truth as often as they say") {
  const int trials = test::trials(2000, 300);
  test::Coverage with_play("joint elasticity with play", 3), noisy("joint elasticity with noisy torques", 2);
  test::Coverage correlated("joint elasticity with correlated angles", 2);
  for (int trial = 0; trial < trials; ++trial) {
    const auto seed = static_cast<std::uint64_t>(100 + trial);
    const SpringTruth play{2e4, 1.5e-3, 3e-4};
    const VectorXd noise = VectorXd::Constant(1, 2.0);
    const JointSpring a = identify_elasticity(springs(play, 150, 1e-4, 2.0, seed), {.torque_noise = noise}).joints[0];
    REQUIRE(a.gap > 0.0);
    with_play.add(Eigen::Vector3d(a.offset - play.offset, a.compliance - 1 / play.stiffness, a.gap - play.gap),
                  a.covariance, a.readings - 3);
    const SpringTruth plain;
    const VectorXd large = VectorXd::Constant(1, 12.0);
    const JointSpring b =
        identify_elasticity(springs(plain, 300, 1e-4, 12.0, seed), {.torque_noise = large, .play = false}).joints[0];
    noisy.add(Eigen::Vector2d(b.offset - plain.offset, b.compliance - 1 / plain.stiffness), b.covariance, 298);
    // Slow loads and angles whose errors last for some readings.
    ElasticityReadings lasting = springs(plain, 400, 0.0, 0.0, seed);
    Random random(seed + 7);
    double error = 0.0;
    for (Index k = 0; k < 400; ++k) {
      error = 0.8 * error + random.normal(1e-4);
      lasting.torque(k, 0) = 50 * std::sin(0.05 * double(k) + 0.01 * trial);
      lasting.motor(k, 0) = lasting.link(k, 0) + plain.offset + lasting.torque(k, 0) / plain.stiffness + error;
    }
    const JointSpring c = identify_elasticity(lasting, {.play = false}).joints[0];
    correlated.add(Eigen::Vector2d(c.offset - plain.offset, c.compliance - 1 / plain.stiffness), c.covariance, 40);
  }
  with_play.check_rate();
  noisy.check_rate();
  correlated.check_rate();
  with_play.check_mean();
  noisy.check_mean();
}

TEST_CASE("a play that is not there, and a stiffness of a rigid joint, are seldom reported") {
  const int trials = test::trials(2000, 300);
  int plays = 0, noisy_plays = 0, springs_found = 0, inside = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const auto seed = static_cast<std::uint64_t>(9000 + trial);
    plays += identify_elasticity(springs({}, 100, 1e-4, 0.0, seed)).joints[0].gap > 0.0;
    noisy_plays +=
        identify_elasticity(springs({8e3}, 200, 1e-5, 2.0, seed), {.torque_noise = VectorXd::Constant(1, 2.0)})
            .joints[0]
            .gap > 0.0;
    const double stiff = 1e9;  // deflections far below the noise
    const ElasticityResult rigid = identify_elasticity(springs({.stiffness = stiff}, 100, 1e-4, 0.0, seed));
    springs_found += rigid.joints[0].told;
    inside += rigid.joints[0].stiffness_low < stiff && stiff < rigid.joints[0].stiffness_high;
    if (!rigid.joints[0].told)
      CHECK_THAT(rigid.fit.message, Contains("joint 1: compliance not distinguishable from 0"));
  }
  for (const int count : {plays, noisy_plays, springs_found})
    CHECK(uncertainty::binomial_interval(count, trials, 0.999).contains(0.01));
  CHECK(uncertainty::binomial_interval(inside, trials, 0.99).contains(0.95));
}

TEST_CASE("loads of one sign leave play and offset together, which is said") {
  ElasticityReadings readings = springs({2e4, 8e-4, 0.0}, 80, 1e-5, 0.0, 3);
  for (Index k = 0; k < 80; ++k)
    if (readings.torque(k, 0) < 0) readings.motor(k, 0) = std::numeric_limits<double>::quiet_NaN();
  const JointSpring one_sided = identify_elasticity(readings).joints[0];
  CHECK(one_sided.stiffness == Approx(2e4).epsilon(0.02));
  CHECK(one_sided.gap == 0.0);
  CHECK(one_sided.offset == Approx(4e-4).epsilon(0.05));
  CHECK_THAT(one_sided.message, Contains("loads of both signs are needed"));
  CHECK(one_sided.told);
  CHECK(one_sided.doubtful);
}

TEST_CASE("readings that tell nothing, or something else, are named") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const ElasticityReadings sound = springs({}, 80, 1e-5, 0.0, 4);
  const auto message = [](const ElasticityReadings& readings, const ElasticityOptions& options = {}) {
    const ElasticityResult out = identify_elasticity(readings, options);
    return (out.fit.usable() ? "usable: " : "") + out.joints[0].message;
  };
  ElasticityReadings bad = sound;
  bad.link.bottomRows(75).setConstant(nan);
  CHECK_THAT(message(bad), Catch::StartsWith("found 5 readings, expected at least 10"));
  bad = sound;
  bad.torque.setConstant(20.0);
  CHECK_THAT(message(bad), Catch::StartsWith("the torques change too little"));
  CHECK_THAT(message(sound, {.torque_noise = VectorXd::Constant(1, 40.0)}),
             Catch::StartsWith("the torques change too little"));
  bad = sound;
  bad.motor += 0.01 * bad.link;
  CHECK_THAT(message(bad), Contains("grows with the angle by 0.00999") && Contains("check the gear ratio"));
  CHECK(identify_elasticity(bad).joints[0].doubtful);
  CHECK_THAT(message(sound), !Contains("ratio"));
  CHECK_FALSE(identify_elasticity(sound).joints[0].doubtful);
  bad = sound;
  bad.motor *= 100.0;
  CHECK_THROWS_WITH(identify_elasticity(bad), Contains("motor: joint 1 differs") && Contains("over the gear ratio"));
  bad = sound;
  bad.motor *= 180 / M_PI;
  CHECK_THROWS_WITH(identify_elasticity(bad), Contains("both in rad or m"));
  bad = sound;
  bad.torque *= -1.0;
  CHECK_THROWS_WITH(identify_elasticity(bad), Contains("torque: joint 1 deflects against its torque"));
  bad = sound;
  std::swap(bad.motor, bad.link);
  CHECK_THROWS_WITH(identify_elasticity(bad), Contains("motor and link are exchanged"));
  bad = sound;
  bad.torque.conservativeResize(70, 1);
  CHECK_THROWS_WITH(identify_elasticity(bad), Contains("torque: expected 80 x 1 numbers, found 70 x 1"));
  bad = sound;
  bad.link(3, 0) = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(identify_elasticity(bad), Contains("link: infinite numbers"));
  CHECK_THROWS_WITH(identify_elasticity({}), Contains("motor: no reading"));
  CHECK_THROWS_WITH(identify_elasticity(sound, {.torque_noise = Eigen::Vector2d(1.0, 1.0)}),
                    Contains("torque_noise: found 2 values, expected 1 or 1"));
  CHECK_THROWS_WITH(identify_elasticity(sound, {.torque_noise = VectorXd::Constant(1, -1.0)}),
                    Contains("torque_noise must not be negative"));
  CHECK_THROWS_WITH(identify_elasticity(sound, {.side_torque = nan}), Contains("side_torque must not be negative"));
}

}  // namespace joint_elasticity_test
