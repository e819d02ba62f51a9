#include <kr5/rsi/emulator.hpp>

#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/rsi/link.hpp>

#include "emulated_arm.hpp"
#include "plain_computer.hpp"

using namespace kr5;
using namespace kr5::rsi;
using kr5::test::deg;
using kr5::test::plain_ipoc_of;
using kr5::test::plain_sen;
using kr5::test::PlainComputer;

namespace emulator_test {

constexpr std::array<double, 6> none = {};
constexpr double cycle = 0.012;  // long enough for a busy machine [s]

TelegramLayout layout_for(const PlainComputer& computer, Controller controller = Controller::Krc4) {
  TelegramLayout out = usual_layout(controller);
  out.address = "127.0.0.1";
  out.port = computer.port();
  out.transport = computer.transport();
  return out;
}

EmulatorOptions options_for(Controller controller = Controller::Krc4) {
  EmulatorOptions out;
  out.controller.rules = usual_rules(controller);
  out.controller.rules.cycle = out.controller.rules.answer_time = cycle;
  out.controller.rules.max_late = 400;  // of a busy machine; what the rules do is tested without a clock
  out.controller.rules.max_late_share.reset();
  out.controller.count_from = CountFrom::Answer;
  out.real_time = {.priority = 0, .lock_memory = false};
  return out;
}

struct Tested {
  Tested(const TelegramLayout& layout, const EmulatorOptions& options)
      : robot(test::prompt_robot(cycle)), of(layout, test::six_joints(), options, robot) {}
  robot::LoopbackRobot robot;
  Emulator of;
};

/// Answers telegrams until there are that many; their IPOCs.
std::vector<std::uint64_t> answered(PlainComputer& computer, int count, double degrees = 0.0) {
  std::vector<std::uint64_t> out;
  while (static_cast<int>(out.size()) < count) {
    const std::string telegram = computer.receive();
    REQUIRE(!telegram.empty());
    const std::string ipoc = plain_ipoc_of(telegram);
    out.push_back(std::stoull(ipoc));
    computer.answer(plain_sen(ipoc, {degrees, 0, 0, 0, 0, 0}));
  }
  return out;
}

/// Until it is so, for ten seconds.
template <class Test>
bool soon(Test test) {
  for (int i = 0; i < 2000 && !test(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return test();
}

TEST_CASE("a computer of anybody's guides the arm over UDP, at a fixed rate", "[real_time]") {
  PlainComputer computer(Transport::Udp);
  Tested emulator(layout_for(computer), options_for());
  const std::vector<std::uint64_t> ipocs = answered(computer, 100, 1.0);
  CHECK(ipocs.front() == 0);
  for (std::size_t i = 1; i < ipocs.size(); ++i) REQUIRE(ipocs[i] == ipocs[i - 1] + 12);
  CHECK(emulator.of.joint_correction()[0] == Approx(1 * deg));
  const EmulatorStatistics s = emulator.of.statistics();
  CHECK(s.controller.phase == ControllerPhase::Running);
  CHECK(s.controller.answered + s.controller.missing >= 98);
  CHECK((s.connected && s.unsent == 0 && s.failure.empty() && s.controller.telegrams.faulty() == 0));
  // Absolute deadlines: what one cycle is late is not added to the next. First and last telegram may be held for 0.1 s.
  const double passed = s.period.mean * static_cast<double>(s.period.count);  // [s]
  CHECK(passed == Approx(static_cast<double>(s.period.count + s.overruns) * cycle).margin(0.1));
}

TEST_CASE("silence does not change the rate, and ends the program after as many cycles as are allowed", "[real_time]") {
  PlainComputer computer(Transport::Udp);
  EmulatorOptions options = options_for();
  options.controller.rules.max_late = 20;
  Tested emulator(layout_for(computer), options);
  std::uint64_t last = answered(computer, 10).back();
  int unanswered = 0;
  for (std::string t = computer.receive(300); !t.empty(); t = computer.receive(300)) {
    REQUIRE(std::stoull(plain_ipoc_of(t)) == last + 12);
    last += 12;
    ++unanswered;
  }
  CHECK((unanswered > 0 && unanswered <= 20));  // fewer, if the last answers were late on a busy machine
  CHECK(emulator.of.statistics().controller.missing_now == 20);
  CHECK(emulator.of.statistics().controller.stop.reason == ProgramStopReason::LateAnswers);
  CHECK(emulator.of.events().back().kind == EventKind::Ended);
}

TEST_CASE("a reset program begins anew from another port, with IPOC at its beginning", "[real_time]") {
  PlainComputer computer(Transport::Udp);
  Tested emulator(layout_for(computer), options_for());
  answered(computer, 20, 2.0);
  const int port = computer.peer_port();
  emulator.of.reset_program();
  REQUIRE(soon([&] { return emulator.of.statistics().controller.programs == 2; }));
  std::uint64_t ipoc = 1;
  for (int i = 0; i < 50 && ipoc != 0; ++i) ipoc = answered(computer, 1).back();
  CHECK(ipoc == 0);
  CHECK(computer.peer_port() != port);
  CHECK(emulator.of.reading().joints[0] > test::bent_joints()[0] + 1.9 * deg);
}

TEST_CASE("an ended program starts again by itself where that is wanted", "[real_time]") {
  PlainComputer computer(Transport::Udp);
  EmulatorOptions options = options_for();
  options.controller.rules.max_late = 20;
  options.restart = 0.05;
  Tested emulator(layout_for(computer), options);
  answered(computer, 5);
  CHECK(soon([&] { return emulator.of.statistics().controller.programs >= 2; }));
  CHECK(emulator.of.statistics().controller.phase == ControllerPhase::Running);
}

TEST_CASE("drives, emergency stop and override are switched while it runs", "[real_time]") {
  PlainComputer computer(Transport::Udp);
  Tested emulator(layout_for(computer), options_for());
  answered(computer, 5);
  emulator.of.set_drives(false);
  CHECK(emulator.of.statistics().controller.phase == ControllerPhase::DrivesOff);
  emulator.of.set_drives(true);
  emulator.of.emergency_stop();
  emulator.of.set_override(0.5);
  const EmulationStatistics s = emulator.of.statistics().controller;
  CHECK((s.phase == ControllerPhase::EmergencyStop && s.override_share == 0.5));
  CHECK_THROWS_AS(emulator.of.set_override(50), InvalidArgument);
  answered(computer, 5);
}

TEST_CASE("a network that loses and doubles telegrams and cuts answers does so, and the rate stays", "[real_time]") {
  PlainComputer computer(Transport::Udp);
  EmulatorOptions options = options_for();
  options.telegram_faults.timed = {{LinkFault::Lose, 0.2, 3}, {LinkFault::Double, 0.4, 2}};
  options.answer_faults.timed = {{LinkFault::Truncate, 0.6, 4}};
  Tested emulator(layout_for(computer), options);
  const std::vector<std::uint64_t> ipocs = answered(computer, 70);
  int gaps = 0, same = 0;
  for (std::size_t i = 1; i < ipocs.size(); ++i) {
    gaps += ipocs[i] == ipocs[i - 1] + 48;
    same += ipocs[i] == ipocs[i - 1];
  }
  CHECK((gaps == 1 && same == 2));
  const EmulatorStatistics s = emulator.of.statistics();
  CHECK((s.telegram_faults.lost == 3 && s.telegram_faults.doubled == 2 && s.answer_faults.truncated == 4));
  CHECK((s.controller.telegrams.faulty() == 4 && s.controller.missing >= 7));
  CHECK(s.controller.repeated + s.controller.late >= 2);  // late: on a busy machine
}

TEST_CASE("a KR C2 connects over TCP, greets, and ends when the computer goes", "[real_time]") {
  PlainComputer computer(Transport::Tcp);
  Tested emulator(layout_for(computer, Controller::Krc2), options_for(Controller::Krc2));
  REQUIRE(computer.accept());
  CHECK(computer.receive() == "<Rob Type=\"KUKA\"><IPOC>0</IPOC></Rob>");
  CHECK(answered(computer, 50, 1.0).back() == 600);
  CHECK(emulator.of.joint_correction()[0] == Approx(1 * deg));
  CHECK(emulator.of.statistics().connected);
  computer.hang_up();
  REQUIRE(soon([&] { return emulator.of.statistics().controller.phase == ControllerPhase::Ended; }));
  CHECK(emulator.of.statistics().controller.stop.reason == ProgramStopReason::Disconnected);
  emulator.of.reset_program();
  REQUIRE(computer.accept());
  CHECK(computer.receive() == "<Rob Type=\"KUKA\"><IPOC>0</IPOC></Rob>");
}

TEST_CASE("a computer that listens later is found, and the arm waits for it", "[real_time]") {
  const int port = PlainComputer(Transport::Tcp).port();
  TelegramLayout layout = usual_layout(Controller::Krc2);
  layout.address = "127.0.0.1";
  layout.port = port;
  layout.transport = Transport::Tcp;
  Tested emulator(layout, options_for(Controller::Krc2));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  CHECK((!emulator.of.statistics().connected && emulator.of.statistics().controller.sent == 0));
  PlainComputer computer(Transport::Tcp, port);
  REQUIRE(computer.accept());
  CHECK(!computer.receive().empty());
}

TEST_CASE("the link of this library and the emulator get on, with nothing lost and the correction made",
          "[real_time]") {
  TelegramLayout layout = usual_layout(Controller::Krc4);
  layout.address = "127.0.0.1";
  layout.port = PlainComputer(Transport::Udp).port();
  LinkOptions options;
  options.cycle = cycle;
  options.real_time = {.priority = 0, .lock_memory = false};
  const Link link(layout, {}, options, [](const robot::RobotReading& reading) noexcept {
    robot::RobotCommand out;
    out.space = robot::CommandSpace::Joints;
    out.joints = reading.joints;
    out.joints[0] = 13 * deg;
    return out;
  });
  Tested emulator(layout, options_for());
  CHECK(soon([&] { return std::abs(emulator.of.reading().joints[0] - 13 * deg) < 1e-6; }));
  CHECK(emulator.of.statistics().controller.telegrams.faulty() == 0);
  CHECK(link.statistics().telegrams.faulty() == 0);
}

TEST_CASE("a port that is taken and options that cannot be are told", "[real_time]") {
  PlainComputer computer(Transport::Udp);
  EmulatorOptions options = options_for();
  options.own_port = computer.port();
  CHECK_THROWS_WITH(Tested(layout_for(computer), options), Catch::Contains("another program"));
  options.own_port = 0;
  options.restart = -1;
  CHECK_THROWS_WITH(Tested(layout_for(computer), options), Catch::StartsWith("restart"));
  TelegramLayout nowhere = layout_for(computer);
  nowhere.address = "robot";
  CHECK_THROWS_WITH(Tested(nowhere, options_for()), Catch::Contains("192.168.1.60"));
}

/// Breaks after some cycles.
class BrokenRobot : public robot::LoopbackRobot {
 public:
  BrokenRobot() : LoopbackRobot(test::prompt_robot(emulator_test::cycle)) {}
  void send(const robot::RobotCommand& command) override {
    if (++sent_ > 5) throw InvalidArgument("the arm is broken");
    LoopbackRobot::send(command);
  }

 private:
  int sent_ = 0;
};

TEST_CASE("a robot that fails ends the emulator with its word, not the program", "[real_time]") {
  PlainComputer computer(Transport::Udp);
  BrokenRobot robot;
  const Emulator emulator(layout_for(computer), test::six_joints(), options_for(), robot);
  CHECK(soon([&] { return emulator.statistics().failure == "the arm is broken"; }));
}

}  // namespace emulator_test
