#include <kr5/arm_log/best_arm.hpp>

#include <catch2/catch.hpp>

#include <kr5/arm_log/diagnose_log.hpp>

#include "arm_log/logged_arm.hpp"

namespace best_arm_test {

using namespace kr5;
using namespace kr5::test;

namespace {

arm_log::BestArmErrors errors_of(const arm_log::ArmLog& log) {
  return arm_log::best_arm_errors(arm_log::prepare_log(log, described_arm()).recording);
}

cell::Cell rubbing_arm() {
  cell::Cell out = moved_arm();
  out.drives->friction.coulomb = Eigen::Vector3d(3.0, 2.0, 0.5);
  return out;
}

}  // namespace

TEST_CASE("efforts that were logged late or early tell their delay") {
  for (const double delay : {0.012, -0.007}) {
    const arm_log::BestArmErrors found = errors_of(logged(rubbing_arm(), {.delay = delay}));
    CHECK(found.delay == Approx(delay).margin(1e-3));
  }
}

TEST_CASE("efforts in time have no delay, and leave no more than their noise") {
  const LoggedMotionOptions options;
  const arm_log::BestArmErrors found = errors_of(logged(rubbing_arm(), options));
  CHECK(found.delay == 0.0);
  CHECK(found.unmeasured.empty());
  REQUIRE(found.errors.size() == 3);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(found.errors[k].column == "motion.tau" + std::to_string(k + 1));
    CHECK(found.errors[k].error < 0.7 * options.noise[k]);
  }
}

TEST_CASE("what no rigid arm with friction shows is an error of the best arm") {
  const LoggedMotionOptions options;
  arm_log::ArmLog log = logged(rubbing_arm(), options);
  const double ripple = 1.5;
  log.effort.col(1).array() += ripple * (40.0 * log.q.col(1).array()).sin();
  const arm_log::BestArmErrors found = errors_of(log);
  CHECK(found.errors[1].error > 0.5 * ripple / std::sqrt(2.0));
  CHECK(found.errors[1].error < 1.2 * ripple / std::sqrt(2.0));
  CHECK(found.errors[0].error < options.noise[0]);
}

TEST_CASE("a joint whose effort is not measured is told, and judged by nothing") {
  arm_log::ArmLog log = logged(rubbing_arm());
  log.effort.col(2) = Random(6).normal_vector(log.t.size(), 0.01);
  const arm_log::BestArmErrors found = errors_of(log);
  CHECK(found.unmeasured == std::vector<int>{2});
  CHECK(found.errors[2].error > 10 * found.errors[0].error);
}

TEST_CASE("commanded motions have no errors of a best arm") {
  cell::Recording recording = arm_log::prepare_log(logged(rubbing_arm()), described_arm()).recording;
  for (cell::Experiment& e : recording.experiments) e.joint_reference = cell::JointReference::Commanded;
  CHECK(arm_log::best_arm_errors(recording).errors.empty());
}

TEST_CASE("the search is as wide as a log needs, unless it was set") {
  const arm_log::BestArmErrors errors{{{"motion.tau1", 0.5}}, {{"motion.tau1", 0.6}}, {}, 0.0};
  const gap::DiagnoseOptions wide = arm_log::widened_search({}, errors, 3);
  CHECK(wide.max_effects == 8);
  CHECK(wide.beam == 1);
  CHECK(wide.refits == 4);
  CHECK(wide.errors_of_recording);
  CHECK(wide.simulator_errors.size() == 1);
  CHECK(wide.noise_correlations.size() == 1);
  CHECK(arm_log::widened_search({}, errors, 9).max_effects == 16);
  gap::DiagnoseOptions own;
  own.max_effects = 3;
  CHECK(arm_log::widened_search(own, errors, 3).max_effects == 3);
  CHECK(arm_log::widened_search({}, {}, 3).max_effects == gap::DiagnoseOptions().max_effects);
  own.simulator_errors = {{"motion.tau2", 1.0}};
  CHECK(arm_log::widened_search(own, errors, 3).simulator_errors[0].column == "motion.tau2");
}

}  // namespace best_arm_test
