#include <kr5/rsi/side_channel.hpp>

#include <chrono>
#include <cmath>
#include <thread>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "plain_controller.hpp"

using namespace kr5;
using namespace kr5::rsi;

namespace side_channel_test {

bool received(SidePort& port) {
  for (int i = 0; i < 200; ++i) {
    if (port.receive()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

TEST_CASE("results of both kinds reach the other end, with their age", "[real_time]") {
  SidePort port(0, "127.0.0.1");
  SideSender sender("127.0.0.1", port.port());
  CHECK_FALSE(port.receive());
  VisionResult hole;
  hole.target = 7;
  hole.T_base_target = to_pose((Vector6() << 0.5, 0.1, 0.2, 0.1, 0.2, 0.3).finished());
  CHECK(sender.send(hole, side_now() - 30'000'000));
  REQUIRE(received(port));
  const SideMessage* got = port.results().latest(SideKind::Vision);
  REQUIRE(got);
  CHECK((got->vision.target == 7 && (got->vision.T_base_target.matrix() - hole.T_base_target.matrix()).norm() < 1e-12));
  CHECK(*port.results().age(SideKind::Vision, side_now()) >= 0.03);
  ForceResult force;
  force.wrench[2] = -10;
  for (int i = 0; i < 5; ++i) CHECK(sender.send(force, side_now()));
  for (int i = 0; i < 200 && port.results().statistics().received < 6; ++i) {
    port.receive();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  CHECK(port.results().latest(SideKind::Force)->sequence == 4);
  CHECK((port.results().statistics().received == 6 && port.results().statistics().lost == 0));
}

TEST_CASE("a result that holds no numbers is not sent, and garbage is counted", "[real_time]") {
  SidePort port(0, "127.0.0.1");
  SideSender sender("127.0.0.1", port.port());
  ForceResult force;
  force.wrench[0] = NAN;
  CHECK_FALSE(sender.send(force, 0));
  kr5::test::PlainClient(SOCK_DGRAM, port.port()).send(std::string(500, 'x'));
  for (int i = 0; i < 200 && port.results().statistics().foreign == 0; ++i) {
    port.receive();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  CHECK(port.results().statistics().foreign == 1);
}

TEST_CASE("addresses and ports that are none are refused", "[real_time]") {
  CHECK_THROWS_AS(SideSender("robot"), InvalidArgument);
  CHECK_THROWS_AS(SideSender("1.2.3.4", 70000), InvalidArgument);
  SidePort port(0, "127.0.0.1");
  CHECK_THROWS_AS(SidePort(port.port(), "127.0.0.1"), IoError);
}

}  // namespace side_channel_test
