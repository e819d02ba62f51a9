#include <kr5/arm_log/torque_constants.hpp>

#include <catch2/catch.hpp>

#include <kr5/arm_log/diagnose_log.hpp>
#include <kr5/core/error.hpp>

#include "arm_log/logged_arm.hpp"

namespace torque_constants_test {

using namespace kr5;
using namespace kr5::test;
using Catch::Matchers::Contains;
using Eigen::Vector3d;

namespace {

/// Currents of an arm with these torque constants and this dry friction.
arm_log::ArmLog with_currents(const Vector3d& constants, const Vector3d& coulomb) {
  cell::Cell arm = moved_arm();
  arm.drives->friction.coulomb = coulomb;
  arm_log::ArmLog log = logged(arm, {.noise = {0.0, 0.0, 0.0}});
  log.current = log.effort * constants.cwiseInverse().asDiagonal();
  Random random(5);
  for (int j = 0; j < 3; ++j) log.current.col(j) += 0.02 * random.normal_vector(log.t.size());
  log.effort.resize(0, 0);
  return log;
}

}  // namespace

TEST_CASE("torque constants are found within their uncertainty, beside friction") {
  const Vector3d constants(20.0, 12.0, 3.0);
  const arm_log::ArmLog log = with_currents(constants, Vector3d(8.0, 4.0, 1.0));
  const arm_log::LogRecording prepared = arm_log::prepare_log(log, described_arm());
  const auto note = std::find_if(prepared.notes.begin(), prepared.notes.end(), [](const arm_log::LogNote& n) {
    return n.kind == arm_log::LogNoteKind::TorqueConstants;
  });
  REQUIRE(note != prepared.notes.end());
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(note->deviations[k] < 0.02 * constants[static_cast<int>(k)]);
    CHECK(std::abs(note->values[k] - constants[static_cast<int>(k)]) < 4 * note->deviations[k]);
    CHECK(prepared.recording.cell.drives->torque_constant[static_cast<int>(k)] == note->values[k]);
  }
}

TEST_CASE("torque constants that a model states stay") {
  cell::Cell model = moved_arm();
  model.drives->torque_constant = Vector3d(5, 6, 7);
  const arm_log::LogRecording prepared =
      arm_log::prepare_log(with_currents(Vector3d(20, 12, 3), Vector3d::Zero()), model, {.trust = true});
  CHECK(prepared.recording.cell.drives->torque_constant == Eigen::VectorXd(Vector3d(5, 6, 7)));
  const arm_log::LogRecording stated = arm_log::prepare_log(with_currents(Vector3d(20, 12, 3), Vector3d::Zero()),
                                                            moved_arm(), {.constants_stated = true, .trust = true});
  CHECK((stated.recording.cell.drives->torque_constant.array() == 1.0).all());
}

TEST_CASE("a current that does not follow the torque of its joint tells no torque constant, and says so") {
  arm_log::ArmLog log = with_currents(Vector3d(20, 12, 3), Vector3d::Zero());
  log.current.col(1) = Random(9).normal_vector(log.t.size());
  CHECK_THROWS_WITH(arm_log::prepare_log(log, described_arm()),
                    Contains("does not tell the torque constant of joint 2") && Contains("torque_constant"));
}

TEST_CASE("a recording without currents has no torque constants to find") {
  const arm_log::LogRecording prepared = arm_log::prepare_log(logged(moved_arm()), described_arm());
  CHECK(arm_log::estimate_torque_constants(prepared.recording).values.size() == 0);
}

}  // namespace torque_constants_test
