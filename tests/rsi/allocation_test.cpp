// What runs in the thread of the link allocates nothing.
#ifndef KR5_SANITIZED

#include <array>
#include <cstddef>
#include <string>

#include <catch2/catch.hpp>

#include <kr5/rsi/link_session.hpp>
#include <kr5/rsi/side_receiver.hpp>
#include <kr5/rsi/test_motion.hpp>

#include "plain_controller.hpp"
#include "rsi/exchange_ring.hpp"
#include "wire_messages.hpp"

namespace {
long rsi_allocations = 0;
}
// What every allocation comes to, Eigen's and that of operator new.
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++rsi_allocations;
  return __libc_malloc(size);
}

using namespace kr5;
using namespace kr5::rsi;

namespace allocation_test {

TEST_CASE("answering a telegram allocates nothing, of joints and of the tool, good and faulty") {
  for (const bool tool : {false, true}) {
    TelegramLayout layout = test::wire_layout("krc4_ros_rsi_ethernet.xml");
    layout.receive = book_layout().receive;
    LinkSession session(layout, {}, {}, [tool](const robot::RobotReading& r) noexcept {
      robot::RobotCommand out;
      out.space = tool ? robot::CommandSpace::Tool : robot::CommandSpace::Joints;
      out.joints = r.joints;
      out.tool = r.T_base_tool;
      out.tool.translation().x() += 0.01;
      return out;
    });
    std::array<std::string, 4> telegrams = {test::plain_rob(1000, test::home), test::plain_rob(1004, test::home),
                                            test::plain_rob(1004, test::home).substr(0, 200), std::string("x")};
    std::size_t answered = 0;
    const long before = rsi_allocations;
    for (const std::string& t : telegrams) answered += !session.answer(t, 1, 0).empty();
    session.note_sent(true, 1, 2);
    session.note_silence(5);
    const long allocated = rsi_allocations - before;
    CHECK(answered == 2);
    CHECK(allocated == 0);
    CHECK(session.statistics().refused == 0);
  }
}

TEST_CASE("answering the telegrams of a job allocates nothing, also where the tool turns all the way") {
  const TelegramLayout layout = job_layout(Controller::Krc4);
  LinkOptions options;
  options.limits.rotation = {50.0, 1e4, M_PI};
  Pose asked = Pose::Identity();
  LinkSession session(layout, {}, options, [&asked](const robot::RobotReading&) noexcept {
    asked.linear() = asked.linear() * Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ());
    return robot::tool_command(asked);
  });
  const TelegramCodec codec(layout, Sender::Controller);
  std::array<char, max_telegram> bytes;
  Telegram t;
  TelegramUnits(layout).set_state({.tool = Pose::Identity(),
                                   .tool_setpoint = Pose::Identity(),
                                   .sensor = Vector6::Constant(1.0),
                                   .program_state = 3},
                                  t);
  std::size_t answered = 0;
  const long before = rsi_allocations;
  for (std::uint64_t k = 0; k < 20; ++k) {
    t.ipoc = Ipoc(1000 + 4 * k);
    const std::size_t size = codec.encode(t, bytes);
    answered += !session.answer({bytes.data(), size}, 1, static_cast<std::int64_t>(k)).empty();
  }
  const long allocated = rsi_allocations - before;
  CHECK(answered == 20);
  CHECK(allocated == 0);
  CHECK(session.statistics().refused == 0);
}

TEST_CASE("recording an exchange and a step of a test motion allocate nothing") {
  ExchangeRing ring(4096);
  const std::string telegram = test::plain_rob(1000, test::home);
  TestMotion motion(test::wire_layout("krc4_ros_rsi_ethernet.xml"), robot::CommandFrame::Base, {});
  robot::RobotReading reading;
  reading.joints = robot::JointVector::Zero(6);
  const long before = rsi_allocations;
  const bool put = ring.put({.telegram = telegram, .answer = telegram}, 0);
  motion.step(reading);
  reading.time = 0.4;
  motion.step(reading);
  const long allocated = rsi_allocations - before;
  CHECK((put && allocated == 0));
}

TEST_CASE("taking a result from the side channel allocates nothing") {
  SideReceiver receiver;
  std::array<char, max_side_message> bytes;
  SideMessage message;
  const long before = rsi_allocations;
  for (const SideKind kind : {SideKind::Vision, SideKind::Force}) {
    message.kind = kind;
    receiver.take({bytes.data(), encode_side(message, bytes)}, 0);
  }
  receiver.take("x", 0);
  receiver.age(SideKind::Force, 1);
  const long allocated = rsi_allocations - before;
  CHECK(allocated == 0);
  CHECK(receiver.statistics().received == 2);
}

}  // namespace allocation_test

#endif
