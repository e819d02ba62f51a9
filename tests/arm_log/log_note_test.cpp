#include <kr5/arm_log/log_note.hpp>

#include <catch2/catch.hpp>

#include "arm_log/logged_arm.hpp"

namespace log_note_test {

using namespace kr5;
using namespace kr5::test;
using arm_log::LogNoteKind;

TEST_CASE("a note tells its numbers with their units, and joints by their names") {
  cell::Cell cell = described_arm();
  CHECK(arm_log::text({.kind = LogNoteKind::TorqueConstants, .values = {20.04, 11, 3}, .deviations = {0.12, 0.1, 0.02}},
                      cell) ==
        "torque constants from the log, for the masses of the model [N m/A]: 20 ± 0.1, 11 ± 0.1, 3 ± 0.02");
  CHECK(arm_log::text({.kind = LogNoteKind::DelayedLoads, .name = "tau", .value = -0.0081234}, cell) ==
        "with masses and friction fitted, the torques match the motion best if they were logged 8.12 ms early");
  CHECK(arm_log::text({.kind = LogNoteKind::UnmeasuredLoads, .joints = {1}}, cell).find("elbow") != std::string::npos);
  CHECK(arm_log::text({.kind = LogNoteKind::JointNoise, .name = "i", .values = {0.1, 0.2, 0.3}}, cell) ==
        "noise of i1 to i3, from neighbouring rows [A]: 0.1, 0.2, 0.3");
  cell.robot.dh[2].type = kinematics::JointType::Prismatic;
  CHECK(arm_log::text({.kind = LogNoteKind::JointNoise, .name = "tau", .values = {0.1, 0.2, 3}}, cell) ==
        "noise of tau1 to tau3, from neighbouring rows: 0.1 N m, 0.2 N m, 3 N");
}

TEST_CASE("every kind of note has a sentence") {
  for (const auto& [kind, name] : enum_names(LogNoteKind{})) {
    const arm_log::LogNote note{
        .kind = kind, .name = "tau", .values = {1, 2, 3}, .deviations = {1, 1, 1}, .joints = {0}};
    INFO(name);
    CHECK(text(note, described_arm()).size() > 20);
  }
}

}  // namespace log_note_test
