#include <kr5/rsi/link_recorder.hpp>

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
using kr5::test::PlainClient;

namespace link_recorder_test {

LinkOptions quiet() {
  LinkOptions out;
  out.real_time = {.priority = 0, .lock_memory = false};
  out.listen = "127.0.0.1";
  return out;
}

TelegramLayout layout(Transport transport = Transport::Udp) {
  TelegramLayout out =
      test::wire_layout(transport == Transport::Udp ? "krc4_ros_rsi_ethernet.xml" : "krc2_ros_rsi_ethernet.xml");
  out.transport = transport;
  out.address = "127.0.0.1";
  out.port = free_port(transport == Transport::Udp ? SOCK_DGRAM : SOCK_STREAM);
  return out;
}

TEST_CASE("what comes is recorded with its answer, in order, over UDP and TCP") {
  for (const Transport transport : {Transport::Udp, Transport::Tcp}) {
    const TelegramLayout of = layout(transport);
    LinkRecorder recorder(of, quiet());
    const PlainClient controller(transport == Transport::Udp ? SOCK_DGRAM : SOCK_STREAM, of.port);
    for (unsigned i = 0; i < 40; ++i) REQUIRE_FALSE(controller.ask(plain_rob(1000 + 4 * i, home)).empty());
    LinkObservations seen = recorder.take();
    controller.ask(plain_rob(1160, home));
    while (seen.exchanges.size() < 41) seen.append(recorder.take());
    CHECK(recorder.take().exchanges.empty());
    CHECK((seen.port == of.port && seen.answering && seen.own_address && seen.dropped == 0));
    for (unsigned i = 0; i <= 40; ++i) {
      const Exchange& e = seen.exchanges[i];
      CHECK(plain_ipoc_of(e.telegram) == std::to_string(1000 + 4 * i));
      CHECK(plain_ipoc_of(e.answer) == plain_ipoc_of(e.telegram));
      CHECK((*e.duration > 0 && e.sender == seen.exchanges[0].sender));
      CHECK((i == 0 || e.time > seen.exchanges[i - 1].time));
    }
    CHECK(seen.exchanges[40].time <= seen.duration);
    CHECK(seen.exchanges[40].wall_time - seen.exchanges[0].wall_time ==
          Approx(seen.exchanges[40].time - seen.exchanges[0].time).margin(0.05));
    CHECK(recorder.statistics().answered == 41);
    if (transport == Transport::Udp) CHECK_THAT(seen.exchanges[0].sender, Catch::StartsWith("127.0.0.1:"));
  }
}

TEST_CASE("faulty datagrams are recorded without answer; who only listens answers nothing") {
  TelegramLayout of = layout();
  of.only_send = true;
  LinkOptions options = quiet();
  CHECK_THROWS_WITH(LinkRecorder(of, options), Catch::StartsWith("only_send"));
  options.answer = false;
  LinkRecorder recorder(of, options);
  const PlainClient controller(SOCK_DGRAM, of.port);
  controller.send("hello");
  CHECK(controller.ask(plain_rob(1000, home), 100).empty());
  LinkObservations seen = recorder.take();
  for (int tries = 0; seen.exchanges.size() < 2 && tries < 1000; ++tries) seen.append(recorder.take());
  REQUIRE(seen.exchanges.size() == 2);
  CHECK((seen.exchanges[0].telegram == "hello" && seen.exchanges[1].answer.empty() && !seen.exchanges[1].duration));
  CHECK_FALSE(seen.answering);
  CHECK(recorder.statistics().answered == 0);
  CHECK(recorder.statistics().unsent == 0);
}

TEST_CASE("datagrams to a port on which nobody listens are noticed") {
  LinkRecorder recorder(layout(), quiet());
  const PlainClient lost(SOCK_DGRAM, free_port(SOCK_DGRAM));
  for (int i = 0; i < 50; ++i) lost.send(plain_rob(1000, home));
  const LinkObservations seen = recorder.take();
  if (seen.datagrams_elsewhere) CHECK(*seen.datagrams_elsewhere >= 25);  // the kernel refuses every other one to send
  CHECK(seen.exchanges.empty());
}

TEST_CASE("an address of another computer is noticed, and a motion needs answers") {
  TelegramLayout of = layout();
  of.address = "192.0.2.1";
  CHECK_FALSE(LinkRecorder(of, quiet()).take().own_address);
  LinkOptions options = quiet();
  options.answer = false;
  CHECK_THROWS_WITH(LinkRecorder(of, options, TestMotionOptions{}), Catch::StartsWith("answer"));
}

}  // namespace link_recorder_test
