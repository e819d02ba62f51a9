#include <kr5/rsi/emulated_controller.hpp>

#include <array>
#include <cmath>
#include <regex>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/rsi/kuka_pose.hpp>

#include "emulated_arm.hpp"
#include "plain_controller.hpp"
#include "support/reference.hpp"
#include "wire_messages.hpp"

using namespace kr5;
using namespace kr5::rsi;
using kr5::test::bent_joints;
using kr5::test::deg;
using kr5::test::plain_ipoc_of;
using kr5::test::plain_sen;
using kr5::test::plain_value;

namespace emulated_controller_test {

constexpr std::array<double, 6> none = {};

std::array<double, 6> first_axis(double degrees) { return {degrees, 0, 0, 0, 0, 0}; }

/// A controller with a prompt robot. What it tells of the first axis and of its correction is in degrees.
struct Tested {
  explicit Tested(const EmulationOptions& options = {}, const TelegramLayout& layout = usual_layout(Controller::Krc4))
      : robot(test::prompt_robot(options.rules.cycle)), of(layout, test::six_joints(), options, robot) {}

  std::string cycle() { return telegram = std::string(of.cycle()); }
  AnswerVerdict answer(const std::array<double, 6>& values, const std::string& element = "AKorr") {
    return of.receive(plain_sen(plain_ipoc_of(telegram), values, element), 0.001);
  }
  /// Cycles with the same answer.
  void cycles(int count, const std::array<double, 6>& values = none, const std::string& element = "AKorr") {
    for (int i = 0; i < count; ++i) {
      cycle();
      answer(values, element);
    }
  }
  void silent_cycles(int count) {
    for (int i = 0; i < count; ++i) cycle();
  }
  double axis() const { return plain_value(telegram, "AIPos", "A1"); }
  double path() const { return plain_value(telegram, "ASPos", "A1"); }
  ControllerPhase phase() const { return of.statistics().phase; }
  ProgramStopReason reason() const { return of.statistics().stop.reason; }
  bool happened(EventKind kind) const {
    for (const ControllerEvent& e : of.events())
      if (e.kind == kind) return true;
    return false;
  }

  robot::LoopbackRobot robot;
  EmulatedController of;
  std::string telegram;
};

/// Limits that do not matter.
EmulationOptions wide() {
  EmulationOptions out;
  out.rules.axis_limit = 1.0;
  return out;
}

EmulationOptions relative() {
  EmulationOptions out = wide();
  out.mode = robot::CommandMode::Relative;
  return out;
}

/// Corrections of the axes that fall back without an answer.
TelegramLayout not_held() {
  TelegramLayout out = usual_layout(Controller::Krc4);
  for (TelegramElement& e : out.receive) e.hold = e.tag == "DiO";
  return out;
}

TEST_CASE("telegrams come every cycle whatever comes back, with IPOC in milliseconds") {
  Tested controller;
  for (int i = 0; i < 50; ++i) {
    CHECK(plain_ipoc_of(controller.cycle()) == std::to_string(4 * i));
    if (i % 3 == 0) controller.answer(none);
    if (i % 3 == 1) controller.of.receive("nonsense", 0.001);
  }
  Tested old({.rules = usual_rules(Controller::Krc2)}, usual_layout(Controller::Krc2));
  old.silent_cycles(2);
  CHECK(plain_ipoc_of(old.telegram) == "12");
}

TEST_CASE("telegrams tell what the arm measures and the path, in the units of the wire") {
  Tested controller;
  controller.cycle();
  CHECK_THAT(controller.telegram, Catch::StartsWith("<Rob TYPE=\"KUKA\"><RIst X="));
  for (int i = 0; i < 6; ++i) {
    const std::string name = "A" + std::to_string(i + 1);
    CHECK(plain_value(controller.telegram, "AIPos", name) == Approx(bent_joints()[i] / deg).margin(1e-3));
    CHECK(plain_value(controller.telegram, "ASPos", name) == Approx(bent_joints()[i] / deg).margin(1e-3));
  }
  const robot::SensorModel model = test::six_joints();
  const Vector6 tool = to_kuka(model.arm.flange(bent_joints()) * model.T_flange_tool);
  for (int i = 0; i < 6; ++i)
    CHECK(plain_value(controller.telegram, "RIst", std::string(1, "XYZABC"[i])) == Approx(tool[i]).margin(1e-3));
}

TEST_CASE("an absolute correction moves the arm, and not the path") {
  Tested controller(wide());
  controller.cycles(3, first_axis(2));
  CHECK((controller.axis() == Approx(12).margin(1e-3) && controller.path() == Approx(10).margin(1e-3)));
  controller.cycles(2, first_axis(-1));
  CHECK((controller.axis() == Approx(9).margin(1e-3) && controller.path() == Approx(10).margin(1e-3)));
}

TEST_CASE("a correction of the tool is made in the axes of the program") {
  for (const auto frame : {robot::CommandFrame::Base, robot::CommandFrame::Tool}) {
    EmulationOptions options;
    options.frame = frame;
    Tested controller(options, usual_layout(Controller::Krc4, CorrectionSpace::Cartesian));
    const Pose before = controller.of.reading().T_base_tool;
    controller.cycles(3, {3, 0, 0, 0, 0, 2}, "RKorr");
    const Pose after = controller.of.reading().T_base_tool;
    const Eigen::Vector3d way(0.003, 0, 0);
    const bool in_tool = frame == robot::CommandFrame::Tool;
    CHECK(
        (after.translation() - before.translation() - (in_tool ? Eigen::Vector3d(before.linear() * way) : way)).norm() <
        1e-8);
    const Eigen::Matrix3d turn = exp_rotation({2 * deg, 0, 0});
    const Eigen::Matrix3d expected =
        in_tool ? Eigen::Matrix3d(before.linear() * turn) : Eigen::Matrix3d(turn * before.linear());
    CHECK((after.linear() - expected).norm() < 1e-8);
  }
}

TEST_CASE("an answer counts once, in time and for its own telegram alone") {
  Tested controller(wide());
  controller.cycle();
  const std::string first = plain_ipoc_of(controller.telegram);
  CHECK(controller.of.receive(plain_sen("4", first_axis(1)), 0.001) == AnswerVerdict::Foreign);
  CHECK(controller.of.receive(plain_sen(first, first_axis(1)), 0.0041) == AnswerVerdict::Late);
  CHECK(controller.answer(first_axis(1)) == AnswerVerdict::Good);
  CHECK(controller.answer(first_axis(9)) == AnswerVerdict::Repeated);
  controller.cycle();
  CHECK(controller.axis() == Approx(11).margin(1e-3));
  CHECK(controller.of.receive(plain_sen(first, first_axis(5)), 0.001) == AnswerVerdict::Late);
  CHECK(controller.of.receive(plain_sen("99999999", first_axis(5)), 0.001) == AnswerVerdict::Foreign);
  controller.cycle();
  CHECK(controller.axis() == Approx(11).margin(1e-3));
  const EmulationStatistics& s = controller.of.statistics();
  CHECK((s.answered == 1 && s.missing == 1 && s.late == 2 && s.foreign == 2 && s.repeated == 1));
}

TEST_CASE(
    "answers with a wrong or repeated IPOC, of another Type, without elements or broken are none: the program stops") {
  const std::vector<std::pair<const char*, std::string>> bad = {
      {"IPOC + 1", plain_sen("$1", none)},
      {"repeated IPOC", plain_sen("0", none)},
      {"another Type", std::regex_replace(plain_sen("$", none), std::regex("ImFree"), "ImBusy")},
      {"no A6", std::regex_replace(plain_sen("$", none), std::regex(" A6=\"[^\"]*\""), "")},
      {"cut", plain_sen("$", none).substr(0, 100)},
      {"no number", std::regex_replace(plain_sen("$", none), std::regex("0\\.000000"), "nan")}};
  for (const auto& [name, text] : bad) {
    INFO(name);
    Tested controller;
    for (int i = 0; i < 100; ++i) {
      const std::string ipoc = plain_ipoc_of(controller.cycle());
      REQUIRE(!ipoc.empty());
      std::string sent = text;
      if (const auto at = sent.find('$'); at != sent.npos) sent.replace(at, 1, ipoc);
      if (i > 0) REQUIRE(controller.of.receive(sent, 0.001) != AnswerVerdict::Good);
    }
    CHECK(controller.phase() == ControllerPhase::Running);
    CHECK(controller.cycle().empty());
    CHECK(controller.reason() == ProgramStopReason::LateAnswers);
  }
}

TEST_CASE("an incomplete answer counts where the controller takes it, and HOLDON decides what it lacks") {
  EmulationOptions options = wide();
  options.rules.accepts_incomplete = true;
  Tested controller(options);
  controller.cycles(2, {1, 2, 0, 0, 0, 0});
  controller.cycle();
  const std::string part =
      "<Sen Type=\"ImFree\"><AKorr A1=\"3.0\" /><IPOC>" + plain_ipoc_of(controller.telegram) + "</IPOC></Sen>";
  CHECK(controller.of.receive(part, 0.001) == AnswerVerdict::Good);
  controller.cycle();
  CHECK(controller.axis() == Approx(13).margin(1e-3));
  CHECK(plain_value(controller.telegram, "AIPos", "A2") == Approx(22).margin(1e-3));
}

TEST_CASE("the program stops with the last of the missing answers that are allowed, not before") {
  for (const int allowed : {1, 10, 100}) {
    EmulationOptions options;
    options.rules.max_late = allowed;
    Tested controller(options);
    controller.cycles(5);
    controller.silent_cycles(allowed - 1);  // the answer to the last one is missing below
    controller.answer(none);
    CHECK(!controller.cycle().empty());
    controller.silent_cycles(allowed - 1);
    CHECK(controller.phase() == ControllerPhase::Running);
    CHECK(controller.cycle().empty());
    CHECK(controller.reason() == ProgramStopReason::LateAnswers);
    CHECK(controller.of.statistics().missing_most == allowed);
    CHECK(controller.cycle().empty());
    CHECK(controller.of.receive(plain_sen("4", none), 0.001) == AnswerVerdict::Unasked);
  }
}

TEST_CASE("a KR C2 stops for a share of late answers, too, and tells late ones in Delay") {
  Tested controller({.rules = usual_rules(Controller::Krc2)}, usual_layout(Controller::Krc2));
  controller.cycle();  // its greeting
  for (int i = 0; i < 99; ++i) {
    controller.cycles(1);
    controller.silent_cycles(1);
  }
  controller.cycle();
  REQUIRE(controller.phase() == ControllerPhase::Running);
  CHECK(plain_value(controller.telegram, "Delay", "D") == 99);
  CHECK(controller.cycle().empty());
  CHECK(controller.reason() == ProgramStopReason::LateShare);
}

TEST_CASE("a KR C2 greets with IPOC alone, which needs no answer, and closes after 10 ms for an answer") {
  Tested controller({.rules = usual_rules(Controller::Krc2)}, usual_layout(Controller::Krc2));
  CHECK(controller.cycle() == "<Rob Type=\"KUKA\"><IPOC>0</IPOC></Rob>");
  controller.cycle();
  CHECK(controller.of.statistics().missing == 0);
  CHECK(controller.of.receive(plain_sen("12", none), 0.0101) == AnswerVerdict::Late);
  CHECK(controller.of.receive(plain_sen("12", none), 0.0099) == AnswerVerdict::Good);
}

TEST_CASE("HOLDON 1 holds the last correction, HOLDON 0 falls back to the path, and the jump is told") {
  Tested held(wide()), falls(wide(), not_held());
  for (Tested* controller : {&held, &falls}) {
    controller->cycles(5, first_axis(4));
    controller->silent_cycles(3);
  }
  CHECK(held.axis() == Approx(14).margin(1e-3));
  CHECK((held.of.statistics().jumps == 0 && !held.happened(EventKind::Jump)));
  CHECK(falls.axis() == Approx(10).margin(1e-3));
  CHECK((falls.of.statistics().jumps == 1 && falls.happened(EventKind::Jump)));
  CHECK(falls.of.statistics().largest_jump == Approx(4 * deg));
}

TEST_CASE("an arm cannot follow the jump of a correction that is not held: the program stops") {
  EmulationOptions options = wide();
  options.axis_speeds = Eigen::VectorXd::Constant(6, 2.7);
  Tested controller(options, not_held());
  for (int i = 0; i <= 40; ++i) controller.cycles(1, first_axis(0.1 * i));
  REQUIRE(controller.phase() == ControllerPhase::Running);
  controller.cycle();
  controller.silent_cycles(1);
  CHECK((controller.reason() == ProgramStopReason::AxisSpeed && controller.of.statistics().stop.axis == 1));
  CHECK_THAT(stop_message(Controller::Krc4, controller.of.statistics().stop), Catch::Contains("Command velocity A1"));
}

TEST_CASE("relative corrections add up what was received, and a missing answer adds nothing") {
  Tested controller(relative());
  controller.cycles(10, first_axis(0.5));
  controller.cycle();
  CHECK(controller.axis() == Approx(15).margin(1e-3));
  controller.silent_cycles(50);
  CHECK(controller.axis() == Approx(15).margin(1e-3));
  controller.answer(first_axis(0.5));
  controller.cycle();
  CHECK(controller.axis() == Approx(15.5).margin(1e-3));
  CHECK(controller.of.statistics().jumps == 0);
}

TEST_CASE("where a held relative correction is repeated, silence moves the arm") {
  EmulationOptions options = relative();
  options.rules.relative_repeats_held = true;
  Tested controller(options);
  controller.cycles(2, first_axis(0.5));
  controller.silent_cycles(11);
  CHECK(controller.axis() == Approx(10 + 0.5 * 12).margin(1e-3));
}

TEST_CASE("relative corrections of zero for as long as the controller suffers stop it, any motion begins anew") {
  EmulationOptions options = relative();
  options.rules.idle_limit = 0.4;
  Tested controller(options), never(relative());
  controller.cycles(99);
  controller.cycles(1, first_axis(0.01));
  controller.cycles(100);
  CHECK(controller.phase() == ControllerPhase::Running);
  CHECK(controller.cycle().empty());
  CHECK(controller.reason() == ProgramStopReason::Idle);
  never.cycles(5000);
  CHECK(never.phase() == ControllerPhase::Running);
}

TEST_CASE("a correction beyond its limit stops the program with the controller's message, and moves nothing") {
  Tested controller;
  controller.cycles(3, first_axis(5.0));
  REQUIRE(controller.phase() == ControllerPhase::Running);
  CHECK(controller.axis() == Approx(15).margin(1e-3));
  controller.answer(none);
  controller.cycles(1, {0, 0, 0, 0, 5.01, 0});
  CHECK(controller.cycle().empty());
  CHECK((controller.reason() == ProgramStopReason::AxisLimit && controller.of.statistics().stop.axis == 5));
  CHECK_THAT(stop_message(Controller::Krc4, controller.of.statistics().stop),
             Catch::Contains("AXISCORR1") && Catch::Contains("A5"));
  CHECK_THAT(stop_message(Controller::Krc2, controller.of.statistics().stop), Catch::Contains("RSI stopped"));
  CHECK(controller.of.reading().joints[4] == Approx(bent_joints()[4]));
  Tested tool({}, usual_layout(Controller::Krc4, CorrectionSpace::Cartesian));
  tool.cycles(1, {0, 0, 5.1, 0, 0, 0}, "RKorr");
  CHECK(tool.cycle().empty());
  CHECK(tool.reason() == ProgramStopReason::TranslationLimit);
}

TEST_CASE("a pose that the arm does not reach stops the program") {
  EmulationOptions options;
  options.rules.translation_limit = 10.0;
  Tested controller(options, usual_layout(Controller::Krc4, CorrectionSpace::Cartesian));
  controller.cycles(2, {3000, 0, 0, 0, 0, 0}, "RKorr");
  CHECK(controller.reason() == ProgramStopReason::Unreachable);
}

TEST_CASE("with drives off the arm stands, corrections move nothing, and telegrams go on as on that controller") {
  for (const bool goes_on : {true, false}) {
    EmulationOptions options = wide();
    options.rules.sends_while_stopped = goes_on;
    Tested controller(options);
    controller.cycles(5, first_axis(1));
    controller.of.set_drives(false);
    for (int i = 0; i < 10; ++i) {
      CHECK(controller.cycle().empty() == !goes_on);
      if (goes_on) CHECK(controller.answer(first_axis(3)) == AnswerVerdict::Good);
      CHECK(controller.of.reading().joints[0] == Approx(11 * deg));
      CHECK(controller.of.reading().status.stopped);
    }
    controller.of.set_drives(true);
    controller.cycles(3, first_axis(3));
    CHECK(controller.axis() == Approx(13).margin(1e-3));
    CHECK(plain_ipoc_of(controller.telegram) == std::to_string(4 * 17));
    CHECK((controller.happened(EventKind::DrivesOff) && controller.happened(EventKind::DrivesOn)));
  }
}

TEST_CASE("relative corrections that come while the drives are off are not made up for") {
  Tested controller(relative());
  controller.cycles(3, first_axis(0.1));
  controller.of.set_drives(false);
  controller.cycles(50, first_axis(0.1));
  controller.of.set_drives(true);
  controller.cycles(3);
  CHECK(controller.axis() == Approx(10.2).margin(0.11));
}

TEST_CASE("an emergency stop is told in the program state, and ends when drives are on again") {
  Tested controller({}, [] {
    TelegramLayout out = usual_layout(Controller::Krc4);
    out.send.push_back({.tag = "ProgStatus.R", .index = 1});
    return out;
  }());
  controller.cycles(2);
  CHECK(plain_value(controller.telegram, "ProgStatus", "R") == 3);
  controller.of.emergency_stop();
  controller.of.set_drives(false);  // they are off already
  controller.cycles(2);
  CHECK((controller.phase() == ControllerPhase::EmergencyStop &&
         plain_value(controller.telegram, "ProgStatus", "R") == 4));
  controller.of.set_drives(true);
  controller.cycles(1);
  CHECK(controller.phase() == ControllerPhase::Running);
}

TEST_CASE("a reset starts the program where the arm stands: IPOC anew, no correction, no memory of late answers") {
  Tested controller(wide());
  controller.cycles(10, first_axis(2));
  controller.silent_cycles(99);
  controller.of.reset_program();
  CHECK(plain_ipoc_of(controller.cycle()) == "0");
  CHECK((controller.axis() == Approx(12).margin(1e-3) && controller.path() == Approx(12).margin(1e-3)));
  controller.silent_cycles(99);
  CHECK(controller.phase() == ControllerPhase::Running);
  controller.cycle();
  CHECK(controller.phase() == ControllerPhase::Ended);
  controller.of.reset_program();
  CHECK((controller.phase() == ControllerPhase::Running && controller.reason() == ProgramStopReason::None));
  CHECK(controller.of.statistics().programs == 3);
  EmulationOptions goes_on = wide();
  goes_on.rules.ipoc_restarts = false;
  Tested other(goes_on);
  other.cycles(10);
  other.of.reset_program();
  CHECK(plain_ipoc_of(other.cycle()) == "40");
}

TEST_CASE("the override makes the path slower, and corrections as the rules say") {
  const auto run = [](double share, bool scales) {
    EmulationOptions options = wide();
    options.rules.override_scales_corrections = scales;
    options.path = {bent_joints() + 30 * deg * Eigen::VectorXd::Unit(6, 0)};
    options.path_speed = 25 * deg;
    Tested controller(options);
    controller.of.set_override(share);
    controller.cycles(100, first_axis(2));
    return std::array<double, 2>{controller.path() - 10, controller.axis() - controller.path()};
  };
  CHECK((run(1.0, false)[0] == Approx(10).margin(1e-2) && run(1.0, false)[1] == Approx(2).margin(1e-2)));
  CHECK((run(0.3, false)[0] == Approx(3).margin(1e-2) && run(0.3, false)[1] == Approx(2).margin(1e-2)));
  CHECK((run(0.3, true)[0] == Approx(3).margin(1e-2) && run(0.3, true)[1] == Approx(0.6).margin(1e-2)));
  Tested controller;
  CHECK_THROWS_AS(controller.of.set_override(30), InvalidArgument);
}

TEST_CASE("cycles before the first good answer count, unless the program waits for the computer") {
  EmulationOptions options;
  options.count_from = CountFrom::Answer;
  Tested waits(options), counts;
  waits.silent_cycles(1000);
  CHECK((waits.phase() == ControllerPhase::Running && waits.of.statistics().missing == 0));
  waits.answer(none);
  waits.silent_cycles(100);  // the first of them judges the answer
  CHECK(waits.phase() == ControllerPhase::Running);
  CHECK(waits.cycle().empty());
  counts.silent_cycles(101);
  CHECK(counts.reason() == ProgramStopReason::LateAnswers);
}

TEST_CASE("the computer ends the motion, or closes the connection") {
  TelegramLayout layout = usual_layout(Controller::Krc4);
  layout.receive.push_back({.tag = "Stop", .type = ValueType::Bool, .index = 8, .meaning = Meaning::StopMove});
  Tested controller({}, layout), closed;
  controller.cycle();
  controller.of.receive(plain_sen("0", none, "AKorr", "<DiO>1</DiO><Stop>1</Stop>"), 0.001);
  CHECK(controller.cycle().empty());
  CHECK(controller.reason() == ProgramStopReason::Asked);
  closed.cycles(3);
  closed.of.disconnect();
  CHECK(closed.cycle().empty());
  CHECK(closed.reason() == ProgramStopReason::Disconnected);
}

TEST_CASE("the bits of the answer move the gripper, and stay without one") {
  Tested controller;
  controller.cycle();
  controller.of.receive(plain_sen("0", none, "AKorr", "<DiO>2</DiO>"), 0.001);
  controller.silent_cycles(5);
  CHECK((!controller.robot.gripper().hold && controller.robot.gripper().air));
}

TEST_CASE("a controller that expects no answers goes on without any") {
  TelegramLayout layout = usual_layout(Controller::Krc4);
  layout.only_send = true;
  Tested controller({}, layout);
  controller.silent_cycles(1000);
  CHECK(controller.phase() == ControllerPhase::Running);
}

TEST_CASE("robots and options that do not fit are refused with what is wrong") {
  robot::LoopbackRobot slow = test::prompt_robot(0.012), quick = test::prompt_robot();
  const TelegramLayout axes = usual_layout(Controller::Krc4);
  const robot::SensorModel model = test::six_joints();
  CHECK_THROWS_WITH(EmulatedController(axes, model, {}, slow), Catch::StartsWith("rules.cycle"));
  robot::SensorModel five = model;
  five.arm.joints.pop_back();
  CHECK_THROWS_WITH(EmulatedController(axes, five, {}, quick), Catch::Contains("5 joints"));
  CHECK_THROWS_WITH(EmulatedController(axes, {}, {}, quick), Catch::Contains("no joints"));
  EmulationOptions options;
  options.axis_speeds = Eigen::VectorXd::Ones(3);
  CHECK_THROWS_WITH(EmulatedController(axes, model, options, quick), Catch::StartsWith("axis_speeds"));
  options = {};
  options.path = {Eigen::VectorXd::Zero(7)};
  CHECK_THROWS_WITH(EmulatedController(axes, model, options, quick), Catch::StartsWith("path[0]"));
  options = {};
  options.override_share = 100;
  CHECK_THROWS_WITH(EmulatedController(axes, model, options, quick), Catch::StartsWith("override_share"));
}

TEST_CASE("telegrams and answers of published drivers go through") {
  EmulationOptions options;
  options.rules.first_ipoc = 123645634563;
  Tested controller(options, test::wire_layout("krc4_ros_rsi_ethernet.xml"));
  const std::regex names("<(\\w+)|(\\w+)=\"");
  const auto shape = [&](const std::string& text) {
    std::string out;
    for (std::sregex_iterator i(text.begin(), text.end(), names), end; i != end; ++i) out += i->str() + " ";
    return out;
  };
  CHECK(shape(controller.cycle()) == shape(test::wire_message("rosi_simulator_first_rob")));
  CHECK(plain_ipoc_of(controller.telegram) == "123645634563");
  const std::string sen = test::wire_message("rosi_hw_interface_zero_sen");
  CHECK(controller.of.receive(sen, 0.001) == AnswerVerdict::Foreign);  // its IPOC is 0
  CHECK(controller.of.receive(std::regex_replace(sen, std::regex(">0<"), ">123645634563<"), 0.001) ==
        AnswerVerdict::Good);
  CHECK(controller.of.receive(test::wire_message("fzi_writer_test_sen"), 0.001) == AnswerVerdict::Faulty);
}

TEST_CASE("a controller tells the wrench of the sensor, what is gripped, and the state of its program") {
  robot::SensorModel model = test::six_joints();
  model.mass = 1.5;
  robot::LoopbackRobot robot({.cycle = 0.004, .delay = 0.004}, model);
  robot.place(bent_joints());
  robot.set_environment([](const Pose&) { return (Vector6() << 1, -2, 3, 0.1, 0.2, -0.3).finished(); });
  const TelegramLayout layout = job_layout(Controller::Krc4);
  EmulatedController controller(layout, model, {}, robot);
  const TelegramCodec reader(layout, Sender::Controller);
  const TelegramUnits units(layout);
  const auto told = [&] {
    Telegram t;
    REQUIRE(reader.decode(controller.cycle(), t) == TelegramFault::None);
    return units.state(t);
  };
  ControllerState now = told();
  REQUIRE((now.sensor && now.gripped && now.program_state));
  CHECK((*now.sensor - controller.reading().sensor).norm() < 1e-3);
  CHECK(now.sensor->norm() > 1.0);
  CHECK((*now.gripped && now.program_state == 3));
  robot.set_status(false, false);
  controller.emergency_stop();
  now = told();
  CHECK_FALSE(*now.gripped);
  CHECK(robot_reading(now, model, 0.0).status.stopped);
}

TEST_CASE("the gripper stays as it is until the first answer, and the fingers close by their bit") {
  const TelegramLayout layout = job_layout(Controller::Krc4);
  for (const bool gripped : {false, true}) {
    robot::LoopbackRobot robot = test::prompt_robot();
    robot.set_status(false, gripped);
    EmulatedController controller(layout, test::six_joints(), {.count_from = CountFrom::Answer}, robot);
    std::string telegram(controller.cycle());
    CHECK(robot.gripper().hold == gripped);
    const std::string stop = "<DiO>5</DiO><Stop>0</Stop>";
    CHECK(controller.receive(plain_sen(plain_ipoc_of(telegram), none, "RKorr", stop), 0.001) == AnswerVerdict::Good);
    controller.cycle();
    controller.cycle();
    CHECK((robot.gripper().hold && robot.gripper().fingers && !robot.gripper().air));
  }
}

}  // namespace emulated_controller_test
