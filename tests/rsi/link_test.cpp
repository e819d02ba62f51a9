#include <kr5/rsi/link.hpp>

#include <chrono>
#include <cmath>
#include <functional>
#include <thread>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "plain_controller.hpp"
#include "wire_messages.hpp"

using namespace kr5;
using namespace kr5::rsi;
using kr5::test::free_port;
using kr5::test::home;
using kr5::test::plain_ipoc_of;
using kr5::test::plain_rob;
using kr5::test::plain_value;
using kr5::test::PlainClient;
using kr5::test::wire_layout;

namespace link_test {

/// Turns the first axis by a tenth of a degree from where it is.
robot::RobotCommand turn(const robot::RobotReading&) noexcept {
  robot::RobotCommand out;
  out.space = robot::CommandSpace::Joints;
  out.mode = robot::CommandMode::Relative;
  out.joints = robot::JointVector::Zero(6);
  out.joints[0] = 0.1 * M_PI / 180;
  return out;
}

/// Whether something holds within some seconds: what the thread of a link notes behind its answer.
bool eventually(const std::function<bool()>& holds) {
  for (int tries = 0; tries < 500; ++tries) {
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return false;
}

LinkOptions quiet() {
  LinkOptions out;
  out.real_time = {.priority = 0, .lock_memory = false};
  out.listen = "127.0.0.1";
  out.silence = 5.0;  // of a busy machine
  return out;
}

TelegramLayout layout_of(Transport transport) {
  TelegramLayout out = wire_layout("krc2_ros_rsi_ethernet.xml");
  out.transport = transport;
  out.port = free_port(transport == Transport::Udp ? SOCK_DGRAM : SOCK_STREAM);
  return out;
}

/// A controller that applies absolute corrections, for some cycles.
std::array<double, 6> guided(const PlainClient& client, int cycles, std::uint64_t ipoc) {
  std::array<double, 6> axes = home;
  for (int i = 0; i < cycles; ++i, ipoc += 4) {
    const std::string answer = client.ask(plain_rob(ipoc, axes));
    REQUIRE(plain_ipoc_of(answer) == std::to_string(ipoc));
    axes[0] = home[0] + plain_value(answer, "AK", "A1");
  }
  return axes;
}

TEST_CASE("a controller is guided over UDP, at its own port", "[real_time]") {
  const TelegramLayout layout = layout_of(Transport::Udp);
  const Link link(layout, {}, quiet(), turn);
  CHECK(link.port() == layout.port);
  const PlainClient controller(SOCK_DGRAM, layout.port);
  CHECK(guided(controller, 500, 1000)[0] == Approx(5.0).epsilon(1e-3));      // at the limit of the correction
  CHECK(eventually([&] { return link.statistics().answer.count == 500; }));  // it counts once it has sent
  const LinkStatistics s = link.statistics();
  CHECK((s.sessions == 1 && s.telegrams.good == 500 && s.answered == 500 && s.lost == 0 && s.unsent == 0));
  CHECK((s.answer.count == 500 && s.lateness.count == 500 && s.answer.p50 > 0 && s.lateness.p50 <= s.answer.p50));
}

TEST_CASE("garbage, a second controller and silence are survived over UDP", "[real_time]") {
  const TelegramLayout layout = layout_of(Transport::Udp);
  LinkOptions options = quiet();
  options.silence = 1.0;
  Link link(layout, {}, options, turn);
  const PlainClient controller(SOCK_DGRAM, layout.port), other(SOCK_DGRAM, layout.port);
  guided(controller, 20, 1000);
  for (const std::string& bad : {std::string("x"), std::string(9000, 'x'), std::string(60000, '<'), std::string()})
    controller.send(bad);
  other.send(plain_rob(5, home));
  CHECK(plain_ipoc_of(controller.ask(plain_rob(1080, home))) == "1080");
  CHECK(other.receive(20).empty());
  LinkStatistics s = link.statistics();
  CHECK((s.telegrams.foreign == 1 && s.telegrams.too_long == 2 && s.telegrams.empty == 1 && s.strangers == 1));
  CHECK(eventually([&] { return link.statistics().state == LinkState::Waiting; }));
  CHECK(guided(other, 20, 7)[0] == 0.0);
  CHECK(link.statistics().state == LinkState::Holding);
  link.resume();
  CHECK(guided(other, 20, 87)[0] > 0.0);
}

TEST_CASE("a controller is guided over TCP, whatever pieces its telegrams come in", "[real_time]") {
  const TelegramLayout layout = layout_of(Transport::Tcp);
  Link link(layout, {}, quiet(), turn);
  {
    const PlainClient controller(SOCK_STREAM, layout.port);
    CHECK(guided(controller, 200, 1000)[0] > 1.0);
    const std::string rob = plain_rob(1800, home);
    controller.send(rob.substr(0, 100));
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    CHECK(plain_ipoc_of(controller.ask(rob.substr(100))) == "1800");
    std::string both = controller.ask(plain_rob(1804, home) + plain_rob(1808, home));
    while (both.find("1808") == both.npos) both += controller.receive();
    CHECK(both.find("<IPOC>1804</IPOC>") < both.find("<IPOC>1808</IPOC>"));
    const PlainClient second(SOCK_STREAM, layout.port);
    CHECK(second.ask(plain_rob(5, home), 200).empty());
    CHECK(eventually([&] { return link.statistics().strangers == 1; }));
    CHECK(plain_ipoc_of(controller.ask(plain_rob(1812, home))) == "1812");
  }
  CHECK(eventually([&] {  // once the end of the first connection is seen
    const PlainClient again(SOCK_STREAM, layout.port);
    const std::string answer = again.ask(plain_rob(1, home), 100);
    return !answer.empty() && plain_value(answer, "AK", "A1") == 0.0 && link.statistics().state == LinkState::Holding;
  }));
}

TEST_CASE("a port that is taken, or an address of another computer, is told", "[real_time]") {
  const TelegramLayout layout = layout_of(Transport::Udp);
  const Link link(layout, {}, quiet(), turn);
  CHECK_THROWS_WITH(Link(layout, {}, quiet(), turn),
                    Catch::Contains(std::to_string(layout.port)) && Catch::Contains("another program"));
  LinkOptions elsewhere = quiet();
  elsewhere.listen = "192.0.2.1";
  CHECK_THROWS_AS(Link(layout_of(Transport::Udp), {}, elsewhere, turn), IoError);
  elsewhere.listen = "robot";
  CHECK_THROWS_WITH(Link(layout_of(Transport::Udp), {}, elsewhere, turn), Catch::Contains("192.168.1.60"));
}

TEST_CASE("the thread asks for priority, and is told what it got", "[real_time]") {
  LinkOptions options = quiet();
  options.real_time.priority = 50;
  const Link link(layout_of(Transport::Udp), {}, options, turn);
  CHECK(link.real_time().priority != Grant::NotAsked);
  CHECK(link.real_time().locked_memory == Grant::NotAsked);
}

}  // namespace link_test
