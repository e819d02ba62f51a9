#include <kr5/arm_log/log_recording.hpp>

#include <catch2/catch.hpp>

#include <kr5/arm_log/model_parts.hpp>
#include <kr5/core/error.hpp>

#include "arm_log/logged_arm.hpp"

namespace log_recording_test {

using namespace kr5;
using namespace kr5::test;
using Catch::Matchers::Contains;

namespace {

cell::Cell with_parts() {
  cell::Cell out = described_arm();
  arm_log::add_parts_to_try(out);
  return out;
}

}  // namespace

TEST_CASE("a log of positions and efforts is a motion on measured positions, the last of it to check") {
  arm_log::ArmLog log = logged(moved_arm());
  log.t.array() += 1.7e9;
  const arm_log::LogRecording out = arm_log::record_log(log, with_parts());
  REQUIRE(out.recording.experiments.size() == 2);
  const cell::Experiment& fit = out.recording.experiments[0];
  CHECK(fit.name == "motion-1");
  CHECK(fit.joint_reference == cell::JointReference::Measured);
  CHECK(fit.split == cell::Split::Fit);
  CHECK(out.recording.experiments[1].split == cell::Split::Check);
  CHECK(fit.data.columns == std::vector<std::string>{"t", "qc1", "qc2", "qc3", "tau1", "tau2", "tau3"});
  CHECK(fit.data.column("t")[0] < 5.0);  // from the beginning of the log
  CHECK(out.recording.experiments[1].data.column("t")[0] > fit.data.column("t")[fit.data.values.rows() - 1]);
  // Efforts are as logged, positions near what was logged.
  const double at = fit.data.column("t")[10];
  const auto row = static_cast<Eigen::Index>(std::lround(at / 0.01));
  CHECK(fit.data.column("tau2")[10] == log.effort(row, 1));
  CHECK(fit.data.column("qc2")[10] == Approx(log.q(row, 1)).margin(1e-4));
}

TEST_CASE("commands are the motion where the cell has a servo that follows them") {
  arm_log::ArmLog log = logged(moved_arm());
  log.command = log.q;
  cell::Cell cell = with_parts();
  CHECK(arm_log::record_log(log, cell).recording.experiments[0].joint_reference == cell::JointReference::Measured);
  cell.servo = arm_cell({"rrr"}).servo;
  const cell::Experiment fit = arm_log::record_log(log, cell).recording.experiments[0];
  CHECK(fit.joint_reference == cell::JointReference::Commanded);
  CHECK(fit.data.find("q1") > 0);
  CHECK(fit.data.find("qc1") > 0);
  CHECK(fit.lead_in.values.rows() > 0);  // the motion does not begin at rest
}

TEST_CASE("a log in which nothing moves, and a model without masses, are refused with a remedy") {
  arm_log::ArmLog log = logged(moved_arm());
  cell::Cell bare = with_parts();
  bare.robot.links.clear();
  CHECK_THROWS_WITH(arm_log::record_log(log, bare), Contains("no masses"));
  log.q.setConstant(0.3);
  CHECK_THROWS_WITH(arm_log::record_log(log, with_parts()), Contains("no joint moves"));
}

}  // namespace log_recording_test
