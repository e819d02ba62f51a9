#include <kr5/rsi/controller_state.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/rsi/kuka_pose.hpp>
#include <kr5/rsi/telegram_codec.hpp>

#include "wire_messages.hpp"

using namespace kr5;
using namespace kr5::rsi;
using kr5::test::wire_layout;
using kr5::test::wire_message;

namespace controller_state_test {

constexpr double deg = M_PI / 180;

TelegramLayout with_everything() {
  TelegramLayout out = wire_layout("fzi_ros_rsi_ethernet.xml");
  out.send.push_back({.tag = "DEF_MACur"});
  out.send.push_back({.tag = "DEF_EIPos"});
  out.send.push_back({.tag = "DiL", .type = ValueType::Long, .index = 9});
  out.receive = book_layout().receive;
  out.receive.push_back({.tag = "EKorr.E1", .index = 30});
  out.receive.push_back({.tag = "Stop", .type = ValueType::Bool, .index = 31});
  out.externals = 1;
  out.linear_externals = {1};
  out.current_units = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7};
  out.gripper.gripped = 3;
  out.gripper.fingers = 5;
  for (const char* name : {"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"})
    out.send.push_back({.tag = std::string("Wrist.") + name,
                        .index = 10 + static_cast<int>(out.send.size()),
                        .meaning = Meaning::SensorWrench});
  return out;
}

TEST_CASE("a published telegram is told in SI") {
  const TelegramLayout layout = kr5::test::fzi_test_layout();
  Telegram t;
  REQUIRE(TelegramCodec(layout, Sender::Controller).decode(wire_message("fzi_parser_test_rob"), t) ==
          TelegramFault::None);
  const ControllerState s = TelegramUnits(layout).state(t);
  REQUIRE((s.tool && s.tool_setpoint && s.joints.size() == 6 && s.joint_setpoints.size() == 6));
  CHECK((s.tool->matrix() - from_kuka((Vector6() << 1, 2, 3, 0.5, 1, 1.5).finished()).matrix()).norm() < 1e-15);
  CHECK(s.tool_setpoint->translation().z() == Approx(0.008));
  CHECK(s.joints[5] == Approx(0.6 * deg));
  CHECK(s.joint_setpoints[0] == Approx(1.0 * deg));
  CHECK((s.late_packets == 42.0 && s.program_state == 3.0 && s.override_share == Approx(0.99)));
  CHECK((s.efforts.size() == 0 && s.currents.size() == 0 && !s.gripped));
}

TEST_CASE("states and corrections go to the wire and back") {
  const TelegramLayout layout = with_everything();
  const TelegramUnits units(layout);
  const TelegramCodec rob(layout, Sender::Controller), sen(layout, Sender::Computer);
  CHECK((units.joints() == 7 && units.corrects_joints() && units.corrects_tool()));
  Random random(4);
  std::array<char, max_telegram> bytes;
  for (int i = 0; i < 100; ++i) {
    ControllerState s;
    Vector6 twist = random.normal_vector(6, 0.3);
    s.tool = to_pose(twist);
    s.tool_setpoint = to_pose(-twist);
    s.joints = random.normal_vector(7, 1.0);
    s.joint_setpoints = random.normal_vector(7, 1.0);
    s.efforts = random.normal_vector(7, 100.0);
    s.currents = random.normal_vector(7, 2.0);
    s.sensor = random.normal_vector(6, 20.0);
    s.late_packets = i;
    s.program_state = 3;
    s.override_share = 0.5;
    s.digital_inputs = 0xA5;
    s.gripped = i % 2 == 0;
    Telegram t, back;
    t.ipoc = Ipoc(std::uint64_t{12});
    units.set_state(s, t);
    REQUIRE(rob.decode({bytes.data(), rob.encode(t, bytes)}, back) == TelegramFault::None);
    const ControllerState r = units.state(back);
    CHECK((r.tool->translation() - s.tool->translation()).norm() < 1e-6);
    CHECK(log_rotation(r.tool->linear().transpose() * s.tool->linear()).norm() < 1e-5);
    CHECK((r.joints - s.joints).norm() < 1e-5);
    CHECK((r.joint_setpoints - s.joint_setpoints).head(6).norm() < 1e-5);
    CHECK((r.efforts - s.efforts).head(6).norm() < 1e-3);
    CHECK((r.currents - s.currents).head(6).norm() < 1e-3);
    REQUIRE(r.sensor);
    CHECK((*r.sensor - *s.sensor).norm() < 1e-3);
    CHECK((r.late_packets == s.late_packets && r.program_state == 3.0 && r.override_share == 0.5));
    CHECK(r.gripped == s.gripped);
    CHECK(r.digital_inputs == (0xA5U & ~8U) + (*s.gripped ? 8U : 0U));
    Correction c;
    c.joints = random.normal_vector(7, 0.01);
    c.tool = to_pose(random.normal_vector(6, 0.01));
    c.gripper = {.hold = i % 3 == 0, .air = i % 2 == 0, .fingers = i % 4 < 2};
    c.stop_move = i % 5 == 0;
    units.set_correction(c, t);
    REQUIRE(sen.decode({bytes.data(), sen.encode(t, bytes)}, back) == TelegramFault::None);
    const Correction d = units.correction(back);
    CHECK((d.joints - c.joints).norm() < 1e-7);
    CHECK((d.tool->matrix() - c.tool->matrix()).norm() < 1e-7);
    CHECK((d.gripper.hold == c.gripper.hold && d.gripper.air == c.gripper.air && d.stop_move == c.stop_move));
    CHECK(d.gripper.fingers == c.gripper.fingers);
  }
}

TEST_CASE("external axes are metres where they are linear, and radians else") {
  TelegramLayout layout = with_everything();
  Telegram t;
  t.ipoc = Ipoc(std::uint64_t{1});
  Correction c;
  c.joints = robot::JointVector::Constant(7, 0.5);
  TelegramUnits(layout).set_correction(c, t);
  const auto fields = telegram_fields(layout.receive);
  const auto at = [&](const std::string& element) {
    for (std::size_t i = 0; i < fields.size(); ++i)
      if (fields[i].element == element) return t.values[i];
    return double(NAN);
  };
  CHECK(at("EKorr") == Approx(500.0));
  CHECK(at("AKorr") == Approx(0.5 / deg));
  layout.linear_externals.clear();
  TelegramUnits(layout).set_correction(c, t);
  CHECK(at("EKorr") == Approx(0.5 / deg));
}

TEST_CASE("a correction without values is all zeros") {
  const TelegramLayout layout = wire_layout("krc4_ros_rsi_ethernet.xml");
  Telegram t;
  t.values.fill(7.0);
  t.ipoc = Ipoc(std::uint64_t{0});
  TelegramUnits(layout).set_correction({}, t);
  std::array<char, 500> bytes;
  const std::size_t size = TelegramCodec(layout, Sender::Computer).encode(t, bytes);
  CHECK(std::string_view(bytes.data(), size) == wire_message("rosi_hw_interface_zero_sen"));
  CHECK_FALSE(TelegramUnits(layout).corrects_tool());
}

TEST_CASE("the wrench of the sensor is in a reading, freed of the tool's weight") {
  robot::SensorModel model;
  model.arm.joints = {{.b = 0.4, .a = 0.18, .alpha = M_PI_2}, {.a = 0.6},        {.a = 0.12, .alpha = M_PI_2},
                      {.b = 0.62, .alpha = -M_PI_2},          {.alpha = M_PI_2}, {.b = 0.115}};
  model.T_flange_tool = Pose(Eigen::Translation3d(0, 0, 0.2));
  model.mass = 2.0;
  ControllerState s;
  s.joints = robot::JointVector::Constant(6, 0.1);
  CHECK(robot_reading(s, model, 0.0).sensor.isZero());
  const Vector6 push = (Vector6() << 1, 2, 3, 0.1, 0.2, 0.3).finished();
  s.sensor = robot::sensed_wrench(model, model.arm.flange(s.joints), push);
  const robot::RobotReading r = robot_reading(s, model, 0.0);
  CHECK(r.sensor == *s.sensor);
  CHECK((r.wrench - push).norm() < 1e-12);
}

TEST_CASE("a program that is not active is a robot that stands") {
  ControllerState s;
  CHECK_FALSE(robot_reading(s, {}, 0.0).status.stopped);
  s.program_state = 3;
  CHECK_FALSE(robot_reading(s, {}, 0.0).status.stopped);
  s.program_state = 4;
  CHECK(robot_reading(s, {}, 0.0).status.stopped);
}

TEST_CASE("without a bit for the fingers nothing is told of them") {
  TelegramLayout layout = with_everything();
  layout.gripper.fingers.reset();
  Telegram t;
  TelegramUnits(layout).set_correction({.gripper = {.hold = true, .fingers = true}}, t);
  CHECK(TelegramUnits(layout).correction(t).gripper.hold);
  CHECK_FALSE(TelegramUnits(layout).correction(t).gripper.fingers);
}

TEST_CASE("a reading has its poses from the joints, or from the controller, or none") {
  robot::SensorModel model;
  model.arm.joints = {{.b = 0.4, .a = 0.18, .alpha = M_PI_2}, {.a = 0.6},        {.a = 0.12, .alpha = M_PI_2},
                      {.b = 0.62, .alpha = -M_PI_2},          {.alpha = M_PI_2}, {.b = 0.115}};
  model.T_flange_tool = Pose(Eigen::Translation3d(0, 0, 0.2));
  ControllerState s;
  s.joints = robot::JointVector::Constant(6, 0.1);
  s.tool = Pose(Eigen::Translation3d(1, 2, 3));
  s.gripped = false;
  robot::RobotReading r = robot_reading(s, model, 5.0);
  CHECK((r.time == 5.0 && r.joints == s.joints && !r.status.gripped));
  CHECK((r.T_base_flange.matrix() - model.arm.flange(s.joints).matrix()).norm() < 1e-12);
  CHECK(r.pose_mismatch == Approx((r.T_base_tool.translation() - Eigen::Vector3d(1, 2, 3)).norm()));
  model.arm.joints.pop_back();  // another arm
  r = robot_reading(s, model, 5.0);
  CHECK((r.T_base_tool.matrix() - s.tool->matrix()).norm() < 1e-12);
  CHECK(r.T_base_flange.translation().z() == Approx(2.8));
  CHECK(r.pose_mismatch == 0.0);
  s.tool.reset();
  CHECK(std::isnan(robot_reading(s, model, 5.0).T_base_tool(0, 0)));
  CHECK(std::isnan(robot_reading({}, {}, 5.0).T_base_tool(0, 0)));
}

}  // namespace controller_state_test
