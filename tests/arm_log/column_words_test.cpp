#include <kr5/arm_log/column_words.hpp>

#include <catch2/catch.hpp>

namespace column_words_test {

using namespace kr5::arm_log;
using Words = std::vector<std::string>;

TEST_CASE("a name is parted at capitals and signs, and run-together commands are one word") {
  CHECK(words_of("jointPosition_#") == Words{"joint", "position", "#"});
  CHECK(words_of("MotorCurrent mA") == Words{"motor", "current", "ma"});
  CHECK(words_of("TCPForce") == Words{"tcp", "force"});
  CHECK(words_of("qCmd") == Words{"q", "cmd"});
  CHECK(words_of("qcmd.#") == Words{"qc", "#"});
  CHECK(words_of("load %") == Words{"load", "%"});
  CHECK(words_of("12 [3]").empty());
}

TEST_CASE("a word means one thing") {
  CHECK(meaning_of("velocities") == ColumnWord::Velocity);
  CHECK(meaning_of("soll") == ColumnWord::Command);
  CHECK(meaning_of("ist") == ColumnWord::Measured);
  CHECK(meaning_of("temperature") == ColumnWord::Other);
  CHECK(meaning_of("elbow") == ColumnWord::None);
}

TEST_CASE("the field of a stem says its quantity, the topic only where the field does not") {
  CHECK(family_of("q#") == ColumnFamily::Position);
  CHECK(family_of("#") == ColumnFamily::Position);
  CHECK(family_of("qc#") == ColumnFamily::Command);
  CHECK(family_of("des_pos_#") == ColumnFamily::Command);
  CHECK(family_of("i#") == ColumnFamily::Current);
  CHECK(family_of("/joint_states/#/effort") == ColumnFamily::Effort);
  CHECK(family_of("/joint_states:velocity[#]") == ColumnFamily::Velocity);
  CHECK(family_of("/command:position[#]") == ColumnFamily::Command);
  CHECK(family_of("/trajectory_state/#/position") == ColumnFamily::Command);
  CHECK(family_of("/controller/feedback/actual/#/position") == ColumnFamily::Position);
}

TEST_CASE("what is no reading of a joint has no family, nor has a commanded load") {
  CHECK(family_of("position_error_#") == ColumnFamily::None);
  CHECK(family_of("motor_temperature_#") == ColumnFamily::None);
  CHECK(family_of("qdd#") == ColumnFamily::None);
  CHECK(family_of("torque_cmd_#") == ColumnFamily::None);
  CHECK(family_of("elbow#") == ColumnFamily::None);
}

TEST_CASE("angles and torques of motors are told from those of joints; a current is no matter of sides") {
  CHECK(on_motor_side("motor_position_#"));
  CHECK(on_motor_side("taum#"));
  CHECK_FALSE(on_motor_side("tau#"));
  CHECK_FALSE(on_motor_side("motor_current_#"));
}

TEST_CASE("a unit is a word anywhere in a stem") {
  CHECK(unit_in("pos_deg_#") == "deg");
  CHECK(unit_in("torque_#_Nm") == "N m");
  CHECK(unit_in("load % #") == "%");
  CHECK(unit_in("q#").empty());
}

TEST_CASE("times are told by the last word of their names") {
  for (const char* name : {"t", "Time", "time_ms", "t [ns]", "% time", "rosbagTimestamp", "/js:header.stamp",
                           "field.header/stamp", "system_clock", "log_time(us)", "__time"}) {
    INFO(name);
    CHECK(names_time(name));
  }
  for (const char* name : {"", "q1", "lifetime", "point", "/time:q1", "times1"}) {
    INFO(name);
    CHECK_FALSE(names_time(name));
  }
  CHECK(time_unit_in("time_ms") == "ms");
  CHECK(time_unit_in("t [ns]") == "ns");
  CHECK(time_unit_in("header.stamp_nanosec") == "ns");
  CHECK(time_unit_in("time").empty());
  CHECK(time_unit_in("q_deg").empty());
}

TEST_CASE("grippers are told by any part of a name") {
  CHECK(names_gripper("leftFingerJoint"));
  CHECK(names_gripper("robotiq_85_gripper"));
  CHECK_FALSE(names_gripper("elbow"));
}

}  // namespace column_words_test
