#include "rsi/exchange_ring.hpp"

#include <string>
#include <thread>

#include <catch2/catch.hpp>

#include <kr5/core/random.hpp>

using namespace kr5;
using namespace kr5::rsi;

namespace exchange_ring_test {

std::string text_of(int number) {
  return std::string(static_cast<std::size_t>(number * 37 % 900), static_cast<char>('a' + number % 26));
}

TEST_CASE("exchanges of any length come out in order, whatever the place in the ring") {
  ExchangeRing ring(4096);
  ExchangeRing::Head head;
  std::string telegram, answer;
  Random random(1);
  int put = 0, taken = 0;
  while (taken < 5000) {
    for (int i = random.integer(6); i >= 0; --i) {
      const std::string a = text_of(put), b = text_of(put + 1);
      if (ring.put({.sender = 9, .arrival = put, .telegram = a, .answer = b, .duration = 2}, 3)) ++put;
    }
    for (int i = random.integer(6); i >= 0 && ring.take(head, telegram, answer); --i, ++taken)
      REQUIRE((head.arrival == taken && head.wall == 3 && telegram == text_of(taken) && answer == text_of(taken + 1)));
  }
  CHECK(put >= taken);
}

TEST_CASE("what there is no room for is refused, and what is there stays") {
  ExchangeRing ring(1000);
  ExchangeRing::Head head;
  std::string telegram, answer;
  const std::string text(500, 'x');
  CHECK(ring.put({.telegram = text}, 0));
  CHECK_FALSE(ring.put({.telegram = text}, 0));
  CHECK((ring.take(head, telegram, answer) && telegram == text && answer.empty()));
  CHECK_FALSE(ring.take(head, telegram, answer));
  CHECK(ring.put({.telegram = text}, 0));
}

TEST_CASE("one thread puts while another takes") {
  ExchangeRing ring(3000);
  constexpr int all = 20000;
  std::thread writer([&] {
    for (int i = 0; i < all;) {
      const std::string text = text_of(i);
      ring.put({.arrival = i, .telegram = text}, 0) ? ++i : 0;
      if (i % 64 == 0) std::this_thread::yield();
    }
  });
  ExchangeRing::Head head;
  std::string telegram, answer;
  int wrong = 0;
  for (int taken = 0; taken < all;) {
    if (!ring.take(head, telegram, answer)) {
      std::this_thread::yield();
      continue;
    }
    wrong += head.arrival != taken || telegram != text_of(taken);
    ++taken;
  }
  writer.join();
  CHECK(wrong == 0);
}

}  // namespace exchange_ring_test
