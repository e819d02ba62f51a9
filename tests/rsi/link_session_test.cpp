#include <kr5/rsi/link_session.hpp>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "plain_controller.hpp"
#include "wire_messages.hpp"

using namespace kr5;
using namespace kr5::rsi;
using kr5::test::home;
using kr5::test::plain_ipoc_of;
using kr5::test::plain_rob;
using kr5::test::plain_value;
using kr5::test::wire_layout;

namespace link_session_test {

constexpr std::int64_t ms = 1'000'000;
constexpr double deg = M_PI / 180;

/// Commands one degree on the first axis, from where the path is.
robot::RobotCommand one_degree(const robot::RobotReading&) noexcept {
  robot::RobotCommand out;
  out.space = robot::CommandSpace::Joints;
  out.joints = robot::JointVector::Zero(6);
  out.joints << 1 * deg, -90 * deg, 90 * deg, 0, 90 * deg, 0;
  return out;
}

struct Tested {
  explicit Tested(const LinkOptions& options = {}, CycleFunction step = one_degree)
      : of(wire_layout("krc4_ros_rsi_ethernet.xml"), {}, options, std::move(step)) {}
  std::string ask(std::uint64_t ipoc, std::int64_t at, std::uint64_t sender = 1, int delay = 0) {
    return std::string(of.answer(plain_rob(ipoc, home, delay), sender, at));
  }
  LinkSession of;
};

TEST_CASE("every telegram is answered with its IPOC, and the correction grows to what is commanded") {
  Tested link;
  std::int64_t now = 0;
  std::string answer;
  for (std::uint64_t i = 0; i < 300; ++i, now += 4 * ms) {
    answer = link.ask(4208163634 + 4 * i, now, 1, 3);
    REQUIRE(plain_ipoc_of(answer) == std::to_string(4208163634 + 4 * i));
    link.of.note_sent(true, 1000, 50000);
  }
  CHECK_THAT(answer, Catch::StartsWith("<Sen Type=\"ImFree\"><AK A1="));
  CHECK(plain_value(answer, "AK", "A1") == Approx(1.0).margin(1e-6));
  CHECK(plain_value(answer, "AK", "A2") == Approx(0.0).margin(1e-6));
  const LinkStatistics s = link.of.statistics();
  CHECK((s.state == LinkState::Running && s.sessions == 1 && s.answered == 300 && s.telegrams.good == 300));
  CHECK((s.lost == 0 && s.late == 0 && s.limited > 0 && s.refused == 0 && s.late_packets == 3));
  CHECK((s.period.count == 299 && s.period.max == Approx(4e-3) && s.answer.p999 == Approx(5e-5)));
}

TEST_CASE("faulty telegrams are counted and change nothing") {
  Tested link;
  const std::string first = link.ask(1000, 0);
  for (const char* bad : {"", "x", "<Rob Type=\"KUKA\"><IPOC>1004</IPOC></Rob>", "<Rob Type=\"KUKA\">"})
    CHECK(link.of.answer(bad, 1, ms).empty());
  CHECK(link.ask(1004, 4 * ms) != first);
  const LinkStatistics s = link.of.statistics();
  CHECK((s.telegrams.empty == 1 && s.telegrams.foreign == 1 && s.telegrams.incomplete == 1 &&
         s.telegrams.truncated == 1));
  CHECK((s.sessions == 1 && s.lost == 0));
}

TEST_CASE("gaps are losses, repeats get the same answer, what was overtaken gets none") {
  Tested link;
  link.ask(1000, 0);
  const std::string answer = link.ask(1016, 16 * ms);
  CHECK(link.of.statistics().lost == 3);
  CHECK(link.ask(1016, 17 * ms) == answer);
  CHECK(link.of.statistics().repeated == 1);
  CHECK(link.ask(1008, 18 * ms).empty());
  CHECK(link.of.statistics().reordered == 1);
  CHECK(plain_ipoc_of(link.ask(1020, 20 * ms)) == "1020");
}

TEST_CASE("IPOC begins again at 2^32 within a session") {
  Tested link;
  for (int i = 0; i < 10; ++i) link.ask((4294967280ULL + 4ULL * static_cast<unsigned>(i)) % 4294967296ULL, 4 * i * ms);
  const LinkStatistics s = link.of.statistics();
  CHECK((s.sessions == 1 && s.lost == 0 && s.reordered == 0));
}

TEST_CASE("a second sender gets no answer while the first is there, and may begin after a silence") {
  Tested link;
  link.ask(1000, 0);
  CHECK(link.ask(77, ms, 2).empty());
  CHECK(link.of.statistics().strangers == 1);
  CHECK_FALSE(link.ask(1004, 4 * ms).empty());
  CHECK_FALSE(link.ask(77, 600 * ms, 2).empty());
  CHECK(link.of.statistics().sessions == 2);
}

TEST_CASE("after a silence, a restart or a lost connection the correction begins at zero and holds until resumed") {
  for (const int how : {0, 1, 2}) {
    Tested link;
    std::int64_t now = 0;
    std::uint64_t ipoc = 100000;
    for (int i = 0; i < 300; ++i, now += 4 * ms, ipoc += 4) link.ask(ipoc, now);
    if (how == 0) now += 800 * ms;  // silence
    if (how == 1) ipoc = 12;        // the controller starts again
    if (how == 2) link.of.end();
    for (int i = 0; i < 50; ++i, now += 4 * ms, ipoc += 4) {
      const std::string answer = link.ask(ipoc, now);
      REQUIRE(plain_value(answer, "AK", "A1") == 0.0);
    }
    CHECK((link.of.statistics().state == LinkState::Holding && link.of.statistics().sessions == 2));
    link.of.resume();
    std::string answer;
    for (int i = 0; i < 300; ++i, now += 4 * ms, ipoc += 4) answer = link.ask(ipoc, now);
    CHECK(plain_value(answer, "AK", "A1") == Approx(1.0).margin(1e-6));
    CHECK(link.of.statistics().state == LinkState::Running);
  }
}

TEST_CASE("a link that begins anew goes on with the correction that the controller holds") {
  Tested link;
  std::array<double, 6> corrected = home;
  corrected[0] += 0.7;
  CHECK(link.of.answer(plain_rob(1000, corrected), 1, 0).empty());  // a path that moves would look alike
  CHECK(link.of.answer(plain_rob(1000, corrected), 1, ms).empty());
  const std::string first(link.of.answer(plain_rob(1004, corrected), 1, 4 * ms));
  CHECK(plain_value(first, "AK", "A1") == Approx(0.7).margin(0.003));  // it moves on from there
  CHECK(plain_value(first, "AK", "A2") == 0.0);
}

TEST_CASE("a link that joins a moving path takes the lag of its servos for no correction") {
  Tested link({}, {});
  std::array<double, 6> path = home, arm = home;
  std::string answer;
  for (unsigned i = 0; i < 200; ++i) {
    path[1] = home[1] + 0.08 * i;
    arm[1] = path[1] - 0.7;
    answer = link.of.answer(plain_rob(1000 + 4 * i, arm, 0, path), 1, 4 * i * ms);
    if (i == 0) CHECK(answer.empty());
    if (i > 0) REQUIRE(plain_value(answer, "AK", "A2") == 0.0);
  }
  CHECK(link.of.statistics().sessions == 1);
}

TEST_CASE("reconnecting may resume at once, from zero") {
  LinkOptions options;
  options.reconnect = Reconnect::Resume;
  Tested link(options);
  for (int i = 0; i < 300; ++i) link.ask(1000 + 4 * static_cast<unsigned>(i), 4 * i * ms);
  const std::string answer = link.ask(9000, 9000 * ms);
  CHECK(std::abs(plain_value(answer, "AK", "A1")) < 0.01);
  CHECK(link.of.statistics().state == LinkState::Running);
}

TEST_CASE("equal telegrams have equal answers, whatever the clock says") {
  Tested a, b;
  for (unsigned i = 0; i < 200; ++i)
    REQUIRE(a.ask(1000 + 4 * i, 4 * i * ms) == b.ask(1000 + 4 * i, (4 * i + i % 3) * ms + 77));
}

TEST_CASE("readings have the axes in radians and the time of IPOC; stops are told") {
  std::vector<robot::RobotReading> seen;
  bool stop = false;
  Tested link({}, [&](const robot::RobotReading& r) noexcept {
    seen.push_back(r);
    robot::RobotCommand out = one_degree(r);
    out.stop = stop;
    return out;
  });
  link.ask(5000, 0);
  stop = true;
  link.ask(5004, 4 * ms);
  const std::string answer = link.ask(5012, 12 * ms);
  REQUIRE(seen.size() == 3);
  CHECK((seen[0].time == Approx(5.0) && seen[2].time == Approx(5.012)));
  CHECK(seen[0].joints[1] == Approx(-90 * deg));
  CHECK(seen[0].T_base_tool.translation().x() == Approx(0.445));
  CHECK((!seen[1].status.stopped && seen[2].status.stopped));
  for (unsigned i = 0; i < 20; ++i) link.ask(5016 + 4 * i, (16 + 4 * i) * ms);
  CHECK(link.ask(5100, 100 * ms).find("A1=\"") != std::string::npos);
  const double rest = plain_value(link.ask(5104, 104 * ms), "AK", "A1");
  CHECK(rest == plain_value(link.ask(5108, 108 * ms), "AK", "A1"));
}

TEST_CASE("answers that leave late or not at all are counted") {
  LinkOptions options;
  options.deadline = 0.002;
  Tested link(options);
  link.ask(1, 0);
  link.of.note_sent(true, 0, 2 * ms + 1);
  link.of.note_sent(false, 0, ms);
  link.of.note_stranger();
  const LinkStatistics s = link.of.statistics();
  CHECK((s.late == 1 && s.answered == 1 && s.unsent == 1 && s.strangers == 1));
  link.of.note_silence(100 * ms);
  CHECK(link.of.statistics().state == LinkState::Running);
  link.of.note_silence(600 * ms);
  CHECK(link.of.statistics().state == LinkState::Waiting);
}

TEST_CASE("a stop ends the motion where the layout has an element for that, also while the link holds") {
  TelegramLayout layout = wire_layout("krc4_ros_rsi_ethernet.xml");
  layout.receive.push_back({.tag = "Stop", .type = ValueType::Bool, .index = 7, .hold = true});
  bool stop = false;
  LinkSession session(layout, {}, {}, [&stop](const robot::RobotReading& r) noexcept {
    robot::RobotCommand out = one_degree(r);
    out.stop = stop;
    return out;
  });
  const TelegramUnits units(layout);
  const TelegramCodec reader(layout, Sender::Computer);
  std::uint64_t ipoc = 10000;
  std::int64_t now = 0;
  const auto ends = [&] {
    Telegram t;
    REQUIRE(reader.decode(session.answer(plain_rob(ipoc += 4, home), 1, now += 4 * ms), t) == TelegramFault::None);
    return units.correction(t).stop_move;
  };
  CHECK_FALSE(ends());
  CHECK_FALSE(ends());
  stop = true;
  CHECK(ends());
  stop = false;
  CHECK_FALSE(ends());
  now += 10'000 * ms;
  CHECK_FALSE(ends());
  CHECK(session.statistics().state == LinkState::Holding);
  stop = true;
  CHECK(ends());
}

TEST_CASE("without a function the answers correct nothing") {
  Tested link({}, {});
  CHECK(link.ask(0, 0) == kr5::test::wire_message("rosi_hw_interface_zero_sen"));
}

TEST_CASE("options of a link are checked by their names") {
  const auto refused = [](auto change, const std::string& field) {
    LinkOptions options;
    change(options);
    CHECK_THROWS_WITH(Tested(options), Catch::StartsWith(field));
  };
  refused([](auto& o) { o.cycle = NAN; }, "cycle");
  refused([](auto& o) { o.deadline = 0.0; }, "deadline");
  refused([](auto& o) { o.deadline = 0.005; }, "deadline");
  refused([](auto& o) { o.silence = 0.001; }, "silence");
  refused([](auto& o) { o.limits.axis.speed = -1; }, "axis.speed");
  refused([](auto& o) { o.real_time.priority = 100; }, "priority");
  TelegramLayout silent = wire_layout("krc4_ros_rsi_ethernet.xml");
  silent.only_send = true;
  CHECK_THROWS_WITH(LinkSession(silent, {}, {}, {}), Catch::StartsWith("only_send"));
}

}  // namespace link_session_test
