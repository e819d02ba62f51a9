#include <kr5/rsi/telegram.hpp>

#include <string>

#include <catch2/catch.hpp>

using namespace kr5::rsi;

namespace telegram_test {

TEST_CASE("an IPOC keeps its text, and is nothing but digits") {
  for (const char* good : {"0", "7", "0042", "4208163634", "18446744073709551615"}) {
    const Ipoc ipoc{std::string_view(good)};
    CHECK((!ipoc.empty() && ipoc.text() == good && std::to_string(ipoc.value()).size() <= ipoc.text().size()));
  }
  for (const char* bad : {"", "-1", "+1", " 1", "1 ", "1.0", "0x1", "18446744073709551616", "000000000000000000001"})
    CHECK(Ipoc{std::string_view(bad)}.empty());
  CHECK(Ipoc(std::uint64_t{4208163634}).text() == "4208163634");
  CHECK(Ipoc(~std::uint64_t{0}).text() == "18446744073709551615");
  CHECK(Ipoc{std::string_view("0042")}.value() == 42);
  CHECK_FALSE(Ipoc{std::string_view("0042")} == Ipoc{std::string_view("42")});
}

TEST_CASE("a message is cut where it is too long") {
  CHECK(MessageText("hello").text() == "hello");
  CHECK(MessageText(std::string(500, 'x')).text() == std::string(127, 'x'));
}

TEST_CASE("every fault has a counter of its own") {
  TelegramCounts counts;
  int all = 0;
  for (const auto& [fault, name] : enum_names(TelegramFault{}))
    for (int i = 0; i <= static_cast<int>(fault); ++i, ++all) counts.count(fault);
  for (const auto& [fault, name] : enum_names(TelegramFault{}))
    CHECK(counts.of(fault) == static_cast<unsigned>(fault) + 1);
  CHECK(counts.good == 1);
  CHECK(counts.faulty() + counts.good == static_cast<unsigned>(all));
}

}  // namespace telegram_test
