#include <kr5/rsi/side_receiver.hpp>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/random.hpp>

using namespace kr5;
using namespace kr5::rsi;

namespace side_receiver_test {

constexpr std::int64_t ms = 1'000'000;

std::string force(std::uint32_t source, std::uint32_t sequence, std::int64_t time, std::int64_t sent) {
  SideMessage m;
  m.kind = SideKind::Force;
  m.source = source;
  m.sequence = sequence;
  m.time = time;
  m.sent = sent;
  m.force.wrench[0] = sequence;
  std::array<char, max_side_message> out;
  return {out.data(), encode_side(m, out)};
}

TEST_CASE("the newest stays through any loss, order and doubling, and all are counted") {
  Random random(11);
  for (int run = 0; run < 50; ++run) {
    std::vector<std::pair<double, std::uint32_t>> order;    // by when they arrive
    const std::uint32_t first = run % 2 ? 0 : 4294967200U;  // across the end of the count
    std::uint64_t sent = 0, dropped = 0, doubled = 0;
    for (std::uint32_t i = 0; i < 500; ++i) {
      ++sent;
      if (i > 0 && i < 499 && random.integer(10) == 0) {
        ++dropped;
        continue;
      }
      order.emplace_back(i + random.uniform(0, 8) * (i > 0), first + i);
      if (random.integer(10) == 0) order.emplace_back(i + random.uniform(8, 16), first + i), ++doubled;
    }
    std::sort(order.begin(), order.end());
    SideReceiver receiver;
    std::uint32_t newest = first;
    for (std::size_t k = 0; k < order.size(); ++k) {
      const std::uint32_t sequence = order[k].second;
      const bool newer = receiver.take(force(5, sequence, 0, 0), static_cast<std::int64_t>(k) * ms);
      CHECK(newer == (k == 0 || static_cast<std::int32_t>(sequence - newest) > 0));
      if (newer) newest = sequence;
      REQUIRE(receiver.latest(SideKind::Force)->sequence == newest);
    }
    const SideStatistics& s = receiver.statistics();
    CHECK((s.received == order.size() && s.repeated == doubled && s.lost == dropped && s.restarts == 0));
    CHECK(newest == first + 499);
    CHECK(receiver.latest(SideKind::Vision) == nullptr);
  }
}

TEST_CASE("a sender that starts again is followed, and what was still on its way from before is not") {
  SideReceiver receiver;
  CHECK(receiver.take(force(1, 700, 0, 0), 0));
  CHECK(receiver.take(force(2, 0, 0, 0), ms));
  CHECK_FALSE(receiver.take(force(1, 701, 0, 0), 2 * ms));
  CHECK(receiver.take(force(2, 1, 0, 0), 3 * ms));
  CHECK((receiver.statistics().restarts == 1 && receiver.statistics().reordered == 1));
}

TEST_CASE("the age is right to the delay of the network, whatever the clocks of the computers say") {
  for (const std::int64_t offset : {std::int64_t{0}, 3'600'000 * ms, -86'400'000 * ms}) {
    Random random(12);
    SideReceiver receiver;
    CHECK_FALSE(receiver.age(SideKind::Force, 0));
    std::int64_t now = 0;
    for (std::uint32_t i = 0; i < 300; ++i) {
      const std::int64_t measured = 10 * i * ms, sent = measured + 5 * ms;
      now = sent + static_cast<std::int64_t>(random.uniform(0.2, 3.0) * ms);
      receiver.take(force(1, i, measured + offset, sent + offset), now);
    }
    const double age = *receiver.age(SideKind::Force, now + 20 * ms);
    const double exact = 1e-9 * static_cast<double>(now + 20 * ms - 2990 * ms);
    CHECK((age <= exact && age > exact - 0.4e-3));
  }
}

TEST_CASE("a clock that drifts is followed") {
  SideReceiver receiver;
  std::int64_t now = 0;
  for (std::uint32_t i = 0; i < 100000; ++i) {
    now = 12 * i * ms;
    const std::int64_t theirs = now + now / 10000;  // 100 ppm
    receiver.take(force(1, i, theirs, theirs), now + ms / 2);
  }
  CHECK(*receiver.age(SideKind::Force, now + ms) == Approx(1e-3).margin(3e-3));
}

TEST_CASE("what is not ours, of another version or damaged is counted and changes nothing") {
  SideReceiver receiver;
  receiver.take(force(1, 1, 0, 0), 0);
  std::string version = force(1, 2, 0, 0), damaged = version;
  version[4] = 2;
  damaged[50] = 1;
  for (const std::string& bad : {std::string("hello"), version, damaged, std::string()})
    CHECK_FALSE(receiver.take(bad, ms));
  const SideStatistics& s = receiver.statistics();
  CHECK((s.foreign == 2 && s.other_version == 1 && s.damaged == 1 && s.received == 1));
  CHECK(receiver.latest(SideKind::Force)->sequence == 1);
}

}  // namespace side_receiver_test
