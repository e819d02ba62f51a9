#include <kr5/rsi/link_faults.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

using namespace kr5;
using namespace kr5::rsi;

namespace link_faults_test {

constexpr double cycle = 0.004;  // [s]

struct Arrival {
  std::string text;
  double time = 0.0;  // [s]
};

/// Messages "0", "1", … a cycle apart, and what arrives of them.
std::vector<Arrival> sent_through(FaultyWay& way, int count, const std::string& padding = "") {
  std::vector<Arrival> out;
  const auto take = [&](double now) {
    while (way.next_time() <= now) {
      const double time = way.next_time();
      out.push_back({std::string(way.next(now)), time});
    }
  };
  for (int i = 0; i < count; ++i) {
    take(i * cycle);
    way.pass(std::to_string(i) + padding, i * cycle);
    take(i * cycle);
  }
  take(1e6);
  return out;
}

LinkFaults at_message(LinkFault fault, int message, int count = 1) {
  LinkFaults out;
  out.delay = 5.5 * cycle;
  out.timed = {{fault, std::max(0.0, message * cycle - 1e-6), count}};
  return out;
}

std::string joined(const std::vector<Arrival>& arrivals) {
  std::string out;
  for (const Arrival& a : arrivals) out += a.text + " ";
  return out;
}

TEST_CASE("without faults every message arrives at once, as it was") {
  FaultyWay way({});
  const std::vector<Arrival> out = sent_through(way, 100);
  REQUIRE(out.size() == 100);
  for (int i = 0; i < 100; ++i) CHECK((out[i].text == std::to_string(i) && out[i].time == i * cycle));
  CHECK((way.counts().passed == 100 && way.counts().lost == 0));
}

TEST_CASE("faults come at the time that is given, and to as many messages") {
  FaultyWay lost(at_message(LinkFault::Lose, 2, 2)), doubled(at_message(LinkFault::Double, 1)),
      swapped(at_message(LinkFault::Reorder, 1)), late(at_message(LinkFault::Late, 1)),
      cut(at_message(LinkFault::Truncate, 1));
  CHECK(joined(sent_through(lost, 6)) == "0 1 4 5 ");
  CHECK(joined(sent_through(doubled, 3)) == "0 1 1 2 ");
  CHECK(joined(sent_through(swapped, 4)) == "0 2 1 3 ");
  CHECK(joined(sent_through(late, 8)) == "0 2 3 4 5 6 1 7 ");
  const std::vector<Arrival> parts = sent_through(cut, 3, std::string(100, 'x'));
  REQUIRE(parts.size() == 3);
  CHECK((parts[1].text.size() < 95 && parts[1].text.size() > 5 && parts[2].text.size() == 101));
  CHECK((lost.counts().lost == 2 && doubled.counts().doubled == 1 && swapped.counts().reordered == 1 &&
         late.counts().late == 1 && cut.counts().truncated == 1));
}

TEST_CASE("shares are kept, within four standard deviations, and add up in one message to one fault") {
  LinkFaults faults;
  faults.late = faults.lose = faults.doubled = faults.reorder = faults.truncate = 0.1;
  FaultyWay way(faults);
  const int n = 10'000;
  const std::size_t arrived = sent_through(way, n).size();
  const LinkFaultCounts& c = way.counts();
  for (const std::uint64_t count : {c.late, c.lost, c.doubled, c.reordered, c.truncated})
    CHECK(std::abs(static_cast<double>(count) - 0.1 * n) < 4 * std::sqrt(n * 0.1 * 0.9));
  CHECK(arrived <= n - c.lost + c.doubled);
  CHECK(arrived + 1 >= n - c.lost + c.doubled);  // the very last may wait for one to overtake it
}

TEST_CASE("the same seed gives the same faults, another one others, also beside faults at given times") {
  const auto run = [](std::uint64_t seed, bool timed) {
    LinkFaults faults;
    faults.lose = 0.3;
    faults.seed = seed;
    if (timed) faults.timed = {{LinkFault::Late, 20 * cycle - 1e-6, 1}};
    FaultyWay way(faults);
    return joined(sent_through(way, 60));
  };
  CHECK(run(1, false) == run(1, false));
  CHECK(run(1, false) != run(2, false));
  CHECK(run(1, true).substr(0, 30) == run(1, false).substr(0, 30));
}

TEST_CASE("jitter delays up to its size, and may change the order") {
  LinkFaults faults;
  faults.jitter = 3 * cycle;
  FaultyWay way(faults);
  const std::vector<Arrival> out = sent_through(way, 1000);
  double most = 0.0;
  bool overtaken = false;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const int number = std::stoi(out[i].text);
    const double late = out[i].time - number * cycle;
    REQUIRE((late >= 0 && late <= 3 * cycle));
    most = std::max(most, late);
    overtaken = overtaken || number != static_cast<int>(i);
  }
  CHECK((most > 2.7 * cycle && overtaken));
}

TEST_CASE("what is on its way when the connection closes does not arrive") {
  FaultyWay way(at_message(LinkFault::Late, 0));
  way.pass("0", 0.0);
  CHECK(way.next_time() == Approx(5.5 * cycle));
  way.clear();
  CHECK(way.next(1.0).empty());
}

TEST_CASE("faults that cannot be are refused with their field") {
  LinkFaults faults;
  faults.lose = 0.6;
  faults.late = 0.6;
  CHECK_THROWS_WITH(FaultyWay(faults), Catch::Contains("more than 1 together"));
  faults.late = -0.1;
  CHECK_THROWS_WITH(FaultyWay(faults), Catch::StartsWith("late"));
  faults.late = 0;
  faults.delay = 0;
  CHECK_THROWS_WITH(FaultyWay(faults), Catch::StartsWith("delay"));
  faults.delay = 0.02;
  faults.timed = {{LinkFault::Lose, -1, 1}};
  CHECK_THROWS_WITH(FaultyWay(faults), Catch::StartsWith("timed[0].time"));
}

}  // namespace link_faults_test
