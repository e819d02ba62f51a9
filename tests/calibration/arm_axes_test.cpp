#include <cmath>
#include <limits>
#include <numbers>

#include <catch2/catch.hpp>

#include <kr5/calibration/arm_axes.hpp>
#include <kr5/core/error.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

#include "calibration/kinematics/arm_parameters.hpp"
#include "calibration/kinematics/shifted_axis.hpp"
#include "calibration/turns_world.hpp"

namespace arm_axes_test {

using namespace kr5;
using namespace kr5::calibration;
using Catch::Matchers::Contains;
using kinematics::DhParameter;
using test::ArmTurns, test::make_arm_turns;

double wrapped(DhParameter what, double change) {
  return is_length(what) ? change : std::remainder(change, 2 * std::numbers::pi);
}

/// Estimated minus true, in the order of the parameters.
Eigen::VectorXd parameter_errors(const ArmAxesResult& r, const kinematics::DhChain& truth) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(r.parameters.size()));
  for (std::size_t i = 0; i < r.parameters.size(); ++i) {
    const ArmParameter& p = r.parameters[i];
    out[static_cast<Eigen::Index>(i)] =
        wrapped(p.parameter, p.value - value_of(truth.joints[static_cast<std::size_t>(p.joint)], p.parameter));
  }
  return out;
}

Eigen::VectorXd stated_std(const ArmAxesResult& r) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(r.parameters.size()));
  for (std::size_t i = 0; i < r.parameters.size(); ++i) out[static_cast<Eigen::Index>(i)] = r.parameters[i].std;
  return out;
}

TEST_CASE("exact turns give the arm to a nanometre, with the parameters that axes determine") {
  Random random(1);
  for (int trial = 0; trial < 5; ++trial) {
    const ArmTurns w = make_arm_turns(random, {.sigma = 0, .home_spread = 0.2});
    const ArmAxesResult r = identify_arm_axes(w.turns, w.home);
    REQUIRE(r.fit.usable());
    REQUIRE(r.axes.size() == 6);
    CHECK(parameter_errors(r, w.truth()).cwiseAbs().maxCoeff() < 1e-8);
    CHECK(stated_std(r).allFinite());
    CHECK(stated_std(r).maxCoeff() < 1e-6);
    CHECK(r.findings.empty());
    CHECK((r.arm.flange(w.home).translation() - w.place_at_home()).norm() < 1e-8);
    REQUIRE(r.parameters.size() == 18);  // of six lines 24 numbers, less the six of their common frame
    std::string second;
    for (const ArmParameter& p : r.parameters)
      if (p.joint == 1) second += std::string(name_of(p.parameter)) + " ";
    CHECK(second == "a alpha beta theta ");  // the axes 2 and 3 are parallel
    CHECK(r.parameters[0].parameter == DhParameter::A);
    CHECK(r.parameters[1].parameter == DhParameter::Alpha);
    CHECK(r.parameters[2].joint == 1);
    CHECK(r.parameters.back().joint == 4);
  }
}

TEST_CASE("twice the std of each parameter holds the truth in 95 % of trials, and so does the region of all",
          "[coverage][statistics][not_sanitized]") {
  const int trials = test::trials(1000, 100);
  for (const bool known : {true, false}) {
    Random random(known ? 2 : 3);
    test::Coverage all(known ? "arm from axes, known noise" : "arm from axes, estimated noise", 18);
    Eigen::VectorXi inside = Eigen::VectorXi::Zero(18);
    for (int trial = 0; trial < trials; ++trial) {
      const ArmTurns w = make_arm_turns(random, {.sigma = 2e-4});
      const ArmAxesResult r = identify_arm_axes(
          w.turns, w.home, {.axis = {.sigma_position = known ? 2e-4 : 0.0, .outlier_false_alarm = 0}});
      REQUIRE(r.fit.usable());
      const Eigen::VectorXd error = parameter_errors(r, w.truth());
      REQUIRE(error.size() == 18);
      all.add(error, r.covariance);
      for (Eigen::Index i = 0; i < 18; ++i) inside[i] += std::abs(error[i]) < 1.96 * stated_std(r)[i];
    }
    all.check_rate();
    int together = 0;
    for (Eigen::Index i = 0; i < 18; ++i) {
      CAPTURE(known, i, inside[i], trials);
      // One of 18 right ones fails in one of 100 runs.
      CHECK(uncertainty::binomial_interval(inside[i], trials, 1 - 0.01 / 18).contains(0.95));
      together += inside[i];
    }
    const double margin = trials >= 1000 ? 0.02 : 0.04;  // those of one trial are not independent of each other
    CHECK(std::abs(together / (18.0 * trials) - 0.95) < margin);
  }
}

TEST_CASE("standard deviations of the parameters are those of axes drawn from their covariances", "[statistics]") {
  Random random(4);
  const ArmTurns w = make_arm_turns(random, {.arc = 20 * test::degree});
  const ArmAxesResult r = identify_arm_axes(w.turns, w.home, {.axis = {.sigma_position = 1e-4}});
  REQUIRE(r.fit.usable());
  const int draws = test::trials(20000, 4000);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(18);
  for (int draw = 0; draw < draws; ++draw) {
    std::vector<kinematics::AxisLine> lines;
    for (const JointAxisResult& axis : r.axes) {
      const Eigen::Matrix4d L = axis.covariance.llt().matrixL();
      lines.push_back(shifted_axis(axis, L * random.normal_vector(4)));
    }
    const kinematics::DhChain drawn = arm_of_lines(lines, w.home, w.place_at_home());
    squares += parameter_errors(r, drawn).cwiseAbs2();
  }
  const Eigen::VectorXd drawn = (squares / draws).cwiseSqrt(), stated = stated_std(r);
  for (Eigen::Index i = 0; i < 18; ++i) {
    CAPTURE(i, drawn[i], stated[i]);
    CHECK(drawn[i] == Approx(stated[i]).epsilon(0.01 + 4 / std::sqrt(2.0 * draws)));  // four standard deviations
    CHECK(r.covariance(i, i) == Approx(stated[i] * stated[i]).epsilon(1e-3));
  }
}

TEST_CASE("neighbours at the limit of near-parallel have finite standard deviations") {
  Random random(5);
  ArmTurns w = make_arm_turns(random);
  for (const double off : {-1e-9, 0.0, 1e-9}) {
    w.arm.joints[1].alpha = std::asin(kinematics::near_parallel_sine) + off;
    w.turns.clear();
    for (int k = 0; k < 6; ++k)
      w.turns.push_back(test::turn_samples(w.arm, w.home, k, w.reflector, 0.0, random, 50 * test::degree));
    const ArmAxesResult r = identify_arm_axes(w.turns, w.home, {.axis = {.sigma_position = 1e-4}});
    REQUIRE(r.fit.usable());
    CAPTURE(off, stated_std(r).transpose());
    CHECK(stated_std(r).maxCoeff() < 0.5);  // a noise of 0.1 mm over the sine, on a short arc
  }
}

TEST_CASE("the arm ends where the measured point is at home, whatever the first sample of the last turn is") {
  Random random(6);
  ArmTurns w = make_arm_turns(random, {.sigma = 1e-5});
  w.turns[5][0].points.col(0) += Eigen::Vector3d(0.03, 0, 0.02);
  const auto end = [&] {
    const ArmAxesResult r = identify_arm_axes(w.turns, w.home);
    REQUIRE(r.fit.usable());
    return Eigen::Vector3d(r.arm.flange(w.home).translation());
  };
  CHECK((end() - w.place_at_home()).norm() < 5e-5);
  // A second point that is seen throughout, the first one in no sample: the axis is there, its first point is not.
  const auto other = test::turn_samples(w.arm, w.home, 5, Eigen::Vector3d(0.2, 0, 0.1), 1e-5, random, 0.8);
  w.turns[5] = other;
  for (JointSample& sample : w.turns[5]) {
    const Eigen::Vector3d seen = sample.points.col(0);
    sample.points.resize(3, 2);
    sample.points.col(0).setConstant(std::numeric_limits<double>::quiet_NaN());
    sample.points.col(1) = seen;
  }
  CHECK(end().allFinite());
}

TEST_CASE("turns of poses give the arm within its uncertainty; it ends in the tool") {
  Random random(10);
  const ArmTurns w = make_arm_turns(random, {.sigma = 1e-5, .home_spread = 0.2, .poses = true});
  const ArmAxesResult r = identify_arm_axes(w.turns, w.home);
  REQUIRE(r.fit.usable());
  REQUIRE(r.parameters.size() == 18);
  const Eigen::VectorXd error = parameter_errors(r, w.truth());
  CAPTURE(error.transpose(), stated_std(r).transpose());
  CHECK((error.array().abs() < 5 * stated_std(r).array()).all());
  CHECK(stated_std(r).maxCoeff() < 1e-3);
  CHECK((r.arm.flange(w.home).translation() - w.place_at_home()).norm() < 1e-4);
  CHECK(r.findings.empty());
}

TEST_CASE("a turn without joint values begins at home, even where its first sample is an outlier") {
  Random random(11);
  ArmTurns w = make_arm_turns(random, {.sigma = 1e-5});
  const Eigen::Vector3d first = w.turns[5][0].points.col(0);
  w.turns[5][0].points.col(0) += 0.03 * kinematics::axes_of(w.arm, w.home)[5].direction;  // at its angle
  for (std::vector<JointSample>& turn : w.turns)
    for (JointSample& sample : turn) sample.q.reset();
  const ArmAxesResult r = identify_arm_axes(w.turns, Eigen::VectorXd::Zero(6));
  REQUIRE(r.fit.usable());
  REQUIRE(r.axes[5].outliers == std::vector<int>{0});
  CHECK((r.arm.flange(Eigen::VectorXd::Zero(6)).translation() - first).norm() < 1e-4);
}

TEST_CASE("turns without joint values begin at home") {
  Random random(7);
  ArmTurns w = make_arm_turns(random, {.sigma = 1e-5});
  const Eigen::Vector3d first = w.turns[5][0].points.col(0);
  for (std::vector<JointSample>& turn : w.turns)
    for (JointSample& sample : turn) sample.q.reset();
  const ArmAxesResult r = identify_arm_axes(w.turns, Eigen::VectorXd::Zero(6));
  REQUIRE(r.fit.usable());
  CHECK(r.findings.empty());
  CHECK((r.arm.flange(Eigen::VectorXd::Zero(6)).translation() - first).norm() < 1e-4);
  CHECK(std::abs(r.arm.joints[2].a) == Approx(0.12).margin(1e-3));
}

TEST_CASE("an axis that its turn does not determine is a status with the joint, one axis alone is an arm") {
  Random random(8);
  ArmTurns w = make_arm_turns(random);
  const auto sound = w.turns;
  for (JointSample& sample : w.turns[2]) sample = w.turns[2].front();
  const ArmAxesResult r = identify_arm_axes(w.turns, w.home);
  CHECK_FALSE(r.fit.usable());
  CHECK_THAT(r.fit.message, Contains("joint 3: the joint did not move"));
  REQUIRE(r.axes.size() == 6);
  CHECK(r.axes[1].fit.usable());
  CHECK_FALSE(r.axes[2].fit.usable());
  CHECK(r.arm.joints.empty());
  CHECK(r.parameters.empty());
  const ArmAxesResult one = identify_arm_axes(std::span(sound).first(1), w.home.head(1));
  REQUIRE(one.fit.usable());
  CHECK(one.arm.joints.size() == 1);
  CHECK(one.parameters.empty());
  CHECK(one.covariance.size() == 0);
}

TEST_CASE("turns that are none, too short or not measured, a home that does not fit and wrong options are refused") {
  Random random(9);
  ArmTurns w = make_arm_turns(random);
  const auto call = [&](const ArmAxesOptions& options = {}) { identify_arm_axes(w.turns, w.home, options); };
  CHECK_THROWS_WITH(call({.axis = {.sigma_position = -1}}), Contains("sigma_position"));
  CHECK_THROWS_WITH(call({.findings = {.min_jump = 0}}), Contains("min_jump"));
  kinematics::DhChain nominal = test::book_arm();
  nominal.joints[2].alpha = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(call({.nominal = nominal}), Contains("nominal: T_base_0 and all parameters must be finite"));
  nominal = test::book_arm(), nominal.T_base_0.translation().x() = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(call({.nominal = nominal}), Contains("nominal: T_base_0 and all parameters must be finite"));
  nominal = test::book_arm(), nominal.joints[4].type = kinematics::JointType::Prismatic;
  CHECK_THROWS_WITH(call({.nominal = nominal}), Contains("nominal: every joint must be revolute"));
  w.home[2] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(call(), Contains("home must be finite"));
  w.home[2] = 0;
  w.turns[1][5].points.setConstant(std::numeric_limits<double>::quiet_NaN());
  CHECK_THROWS_WITH(call(), Contains("joint 2: sample 5: nothing was measured"));
  w.turns[1].resize(3);
  CHECK_THROWS_WITH(call(), Contains("joint 2: an axis needs at least four samples, found 3"));
  w.turns.pop_back();
  CHECK_THROWS_WITH(call(), Contains("home: expected 5 joint values, found 6"));
  w.turns.clear();
  CHECK_THROWS_AS(call(), InvalidArgument);
}

}  // namespace arm_axes_test
