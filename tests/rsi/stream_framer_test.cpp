#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/random.hpp>

#include "rsi/stream_framer.hpp"

using namespace kr5;
using namespace kr5::rsi;

namespace stream_framer_test {

TEST_CASE("telegrams are cut out of a stream, whatever pieces it comes in") {
  Random random(13);
  std::vector<std::string> sent, got;
  std::string stream;
  for (int i = 0; i < 300; ++i) {
    sent.push_back("<Rob>" + std::string(static_cast<std::size_t>(random.integer(2000)), 'a') + "</Ro</Rob>");
    stream += sent.back();
  }
  StreamFramer framer("</Rob>");
  for (std::size_t at = 0; at < stream.size();) {
    const std::size_t piece =
        std::min({stream.size() - at, framer.room().size(), 1 + static_cast<std::size_t>(random.integer(3000))});
    std::copy_n(stream.begin() + static_cast<std::ptrdiff_t>(at), piece, framer.room().begin());
    framer.added(piece);
    at += piece;
    for (std::string_view next = framer.next(); !next.empty(); next = framer.next()) got.emplace_back(next);
  }
  CHECK(got == sent);
}

TEST_CASE("a stream without an end is handed on in parts that are too long, and never fills up") {
  StreamFramer framer("</Rob>");
  std::size_t total = 0;
  for (int i = 0; i < 100; ++i) {
    const std::span<char> room = framer.room();
    REQUIRE(room.size() >= max_telegram);
    const std::size_t piece = std::min<std::size_t>(room.size(), 5000);
    std::fill_n(room.begin(), piece, 'x');
    framer.added(piece);
    for (std::string_view next = framer.next(); !next.empty(); next = framer.next()) {
      CHECK(next.size() > max_telegram);
      total += next.size();
    }
  }
  CHECK(total > 400000);
}

}  // namespace stream_framer_test
