#include <kr5/arm_log/joint_reading.hpp>

#include <catch2/catch.hpp>

#include <kr5/arm_log/diagnose_log.hpp>

#include "arm_log/logged_arm.hpp"

namespace joint_reading_test {

using namespace kr5;
using namespace kr5::test;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// The motion to fit of a log, with its model; what speaks against it stays unsaid.
cell::Recording recorded(const arm_log::ArmLog& log) {
  return arm_log::prepare_log(log, described_arm(), {.trust = true}).recording;
}

}  // namespace

TEST_CASE("a log that fits has no other reading") {
  const cell::Recording found = recorded(logged(moved_arm()));
  CHECK(arm_log::load_likeness(found.cell, found.experiments[0]) > 0.95);
  CHECK_FALSE(arm_log::fitting_order(found.cell, found.experiments[0]));
  CHECK_FALSE(arm_log::fitting_convention(found.cell, found.experiments[0]));
}

TEST_CASE("joints in another order are found by their loads") {
  arm_log::ArmLog log = logged(moved_arm());
  log.q.col(0).swap(log.q.col(1));
  log.effort.col(0).swap(log.effort.col(1));
  const cell::Recording found = recorded(log);
  const auto order = arm_log::fitting_order(found.cell, found.experiments[0]);
  REQUIRE(order);
  CHECK(*order == std::vector<int>{1, 0, 2});
}

TEST_CASE("a joint that is counted the other way is found by its loads") {
  arm_log::ArmLog log = logged(moved_arm());
  log.q.col(1) *= -1;
  log.effort.col(1) *= -1;
  const cell::Recording found = recorded(log);
  const auto reading = arm_log::fitting_convention(found.cell, found.experiments[0]);
  REQUIRE(reading);
  CHECK(reading->sign == std::vector<int>{1, -1, 1});
  CHECK(reading->zero == std::vector<double>{0, 0, 0});
}

TEST_CASE("a joint that is counted from another zero is found by its loads") {
  arm_log::ArmLog log = logged(moved_arm());
  log.q.col(1).array() -= 1.5707963267948966;
  const cell::Recording found = recorded(log);
  const auto reading = arm_log::fitting_convention(found.cell, found.experiments[0]);
  REQUIRE(reading);
  CHECK(reading->zero[1] == Approx(1.5707963267948966));
  CHECK(reading->sign == std::vector<int>{1, 1, 1});
}

TEST_CASE("commanded motions are not read another way") {
  cell::Recording found = recorded(logged(moved_arm()));
  found.experiments[0].joint_reference = cell::JointReference::Commanded;
  CHECK(arm_log::load_likeness(found.cell, found.experiments[0]) == 1.0);
  CHECK_FALSE(arm_log::fitting_order(found.cell, found.experiments[0]));
}

TEST_CASE("the lever arm of a joint is that of all it carries") {
  cell::Cell cell = described_arm();
  const VectorXd q = VectorXd::Zero(3);
  const VectorXd bare = arm_log::lever_arms(cell, q);
  cell.tool = cell::Tool{};
  cell.tool->mass = 1e6;  // all of the mass
  cell.tool->com = Eigen::Vector3d(0.4, 0.0, 0.0);
  const VectorXd loaded = arm_log::lever_arms(cell, q);
  const kinematics::DhChain chain = cell::nominal_chain(cell);
  const Pose before = chain.link_poses(q)[1];  // the axis of joint 3
  const Eigen::Vector3d centre = chain.flange(q) * cell.tool->com - before.translation();
  CHECK(loaded[2] == Approx(centre.cross(before.rotation().col(2)).norm()).epsilon(1e-4));
  CHECK(bare[2] < loaded[2]);
}

}  // namespace joint_reading_test
