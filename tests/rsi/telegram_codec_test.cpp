#include <kr5/rsi/telegram_codec.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <regex>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

#include "wire_messages.hpp"

using namespace kr5;
using namespace kr5::rsi;
using kr5::test::fzi_test_layout;
using kr5::test::wire_layout;
using kr5::test::wire_message;

namespace telegram_codec_test {

std::string encoded(const TelegramCodec& codec, const Telegram& telegram) {
  std::array<char, max_telegram> out;
  return {out.data(), codec.encode(telegram, out)};
}

TelegramFault fault_of(const TelegramCodec& codec, const std::string& text) {
  Telegram out;
  return codec.decode(text, out);
}

double value_of(const TelegramCodec& codec, const Telegram& t, const std::string& element,
                const std::string& attribute) {
  for (std::size_t i = 0; i < codec.fields().size(); ++i)
    if (codec.fields()[i].element == element && codec.fields()[i].attribute == attribute) return t.values[i];
  return NAN;
}

TEST_CASE("the telegrams of published drivers are read") {
  const TelegramCodec fzi(fzi_test_layout(), Sender::Controller);
  Telegram t;
  REQUIRE(fzi.decode(wire_message("fzi_parser_test_rob"), t) == TelegramFault::None);
  CHECK((t.ipoc.text() == "123645634563" && t.ipoc.value() == 123645634563 && t.unknown == 0));
  CHECK(value_of(fzi, t, "RIst", "Z") == 3.0);
  CHECK(value_of(fzi, t, "RSol", "C") == 0.5);
  CHECK(value_of(fzi, t, "AIPos", "A6") == 0.6);
  CHECK(value_of(fzi, t, "ASPos", "A2") == 0.9);
  CHECK(value_of(fzi, t, "ProgStatus", "R") == 3.0);
  CHECK(value_of(fzi, t, "OvPro", "R") == 99.0);
  CHECK(value_of(fzi, t, "Delay", "D") == 42.0);
  const TelegramCodec rosi(wire_layout("krc4_ros_rsi_ethernet.xml"), Sender::Controller);
  REQUIRE(rosi.decode(wire_message("rosi_simulator_first_rob"), t) == TelegramFault::None);
  CHECK((t.ipoc.text() == "0" && value_of(rosi, t, "AIPos", "A2") == -90.0));
  const TelegramCodec sen(fzi_test_layout(), Sender::Computer);
  REQUIRE(sen.decode(wire_message("fzi_writer_test_sen"), t) == TelegramFault::None);
  CHECK((t.ipoc.text() == "123456" && value_of(sen, t, "AK", "A6") == 5.0));
}

TEST_CASE("the telegrams of published drivers are written byte by byte") {
  TelegramLayout layout = wire_layout("krc4_ros_rsi_ethernet.xml");
  layout.decimals = 1;
  for (const auto& [id, sender, own] : {std::tuple{"fzi_writer_test_sen", Sender::Computer, fzi_test_layout()},
                                        {"rosi_hw_interface_zero_sen", Sender::Computer, layout},
                                        {"rosi_simulator_first_rob", Sender::Controller, layout}}) {
    const TelegramCodec codec(own, sender);
    Telegram t;
    REQUIRE(codec.decode(wire_message(id), t) == TelegramFault::None);
    CHECK(encoded(codec, t) == wire_message(id));
  }
  const TelegramCodec c2(wire_layout("krc2_ros_rsi_ethernet.xml"), Sender::Controller);
  Telegram t;
  t.ipoc = Ipoc(std::uint64_t{7});
  CHECK_THAT(encoded(c2, t), Catch::StartsWith("<Rob Type=\"KUKA\"><RIst X=\"0.0000\""));
}

TEST_CASE("what is written is read again, texts and all types of values too") {
  TelegramLayout layout = book_layout();
  layout.decimals = 9;
  Random random(2);
  for (const Sender sender : {Sender::Controller, Sender::Computer}) {
    const TelegramCodec codec(layout, sender);
    const double step = sender == Sender::Controller ? 1e-9 : 1e-6;
    for (int i = 0; i < 200; ++i) {
      Telegram t, back;
      for (std::size_t k = 0; k < codec.fields().size(); ++k) {
        const ValueType type = codec.fields()[k].type;
        const double value = random.uniform(-1, 1) * std::pow(10, random.uniform(-6, 6));
        t.values[k] = type == ValueType::Bool ? (value > 0) : type == ValueType::Long ? std::round(value) : value;
      }
      t.message = MessageText("hello <" + std::to_string(i) + ">");
      t.ipoc = Ipoc(static_cast<std::uint64_t>(random.engine()()));
      REQUIRE(codec.decode(encoded(codec, t), back) == TelegramFault::None);
      CHECK((back.ipoc == t.ipoc && back.unknown == 0));
      for (std::size_t k = 0; k < codec.fields().size(); ++k)
        if (codec.fields()[k].type != ValueType::String)
          CHECK(std::abs(back.values[k] - t.values[k]) <= 0.51 * step + 1e-15 * std::abs(t.values[k]) * 4);
      if (sender == Sender::Computer) CHECK(back.message.text() == "hello  " + std::to_string(i) + " ");
    }
  }
}

TEST_CASE("order, blanks, quotes and what the layout does not know do no harm") {
  const TelegramCodec codec(wire_layout("krc4_ros_rsi_ethernet.xml"), Sender::Computer);
  Telegram t;
  for (const char* text : {"<Sen Type='ImFree'><IPOC> 12 </IPOC><AK A6='6' A5='5' A4='4' A3='3' A2='2' A1='1'/></Sen>",
                           "\xEF\xBB\xBF<?xml version=\"1.0\"?>\r\n<Sen  Type = \"ImFree\" >\r\n <!-- a -->\t<AK A1 = "
                           "\"1\" A2=\"2\" A3=\"3.0e0\" "
                           "A4=\"+4\"\n A5=\" 5 \" A6=\"6\" ></AK>\n <IPOC\n>12</IPOC>\n</Sen >\r\n",
                           "<Sen Type=\"ImFree\"><AK A1=\"1\" A2=\"2\" A3=\"3\" A4=\"4\" A5=\"5\" A6=\"6\" A7=\"7\" "
                           "/><New a=\"b\">text</New>"
                           "<IPOC>12</IPOC></Sen>"}) {
    INFO(text);
    REQUIRE(codec.decode(text, t) == TelegramFault::None);
    for (std::size_t i = 0; i < 6; ++i) CHECK(t.values[i] == static_cast<double>(i + 1));
    CHECK(t.ipoc.text() == "12");
  }
  CHECK(t.unknown == 2);
  const std::string padded = wire_message("rosi_hw_interface_zero_sen") + std::string(3, '\0');
  CHECK(codec.decode(padded, t) == TelegramFault::None);
}

TEST_CASE("every fault has its kind") {
  const TelegramLayout layout = wire_layout("krc4_ros_rsi_ethernet.xml");
  const TelegramCodec sen(layout, Sender::Computer), rob(layout, Sender::Controller);
  const std::string good = wire_message("rosi_hw_interface_zero_sen");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string out = good;
    out.replace(out.find(from), from.size(), to);
    return fault_of(sen, out);
  };
  CHECK(fault_of(sen, "") == TelegramFault::Empty);
  CHECK(fault_of(sen, std::string(max_telegram + 1, ' ')) == TelegramFault::TooLong);
  CHECK(fault_of(rob, good) == TelegramFault::Foreign);
  CHECK(fault_of(sen, "GET / HTTP/1.1\r\n\r\n") == TelegramFault::Foreign);
  CHECK(with("ImFree", "Other") == TelegramFault::Foreign);
  CHECK(with(" Type=\"ImFree\"", "") == TelegramFault::Foreign);
  CHECK(with("</Sen>", "") == TelegramFault::Truncated);
  CHECK(with("</Sen>", "</Sam>") == TelegramFault::Malformed);
  CHECK(with("</Sen>", "</Sen>x") == TelegramFault::Malformed);
  CHECK(with("</Sen>", "</Sen>" + good) == TelegramFault::Malformed);
  CHECK(with("<AK ", "<AK =") == TelegramFault::Malformed);
  CHECK(with("A1=\"0.000000\"", "A1=\"0.000000") == TelegramFault::BadNumber);  // up to the next quote
  CHECK(with("A6=\"0.000000\"", "A6=\"0.000000") == TelegramFault::Malformed);
  CHECK(with("<AK ", "<AK A1=\"1\" ") == TelegramFault::Duplicate);
  CHECK(with("<AK ", "<AK /><AK ") == TelegramFault::Duplicate);
  CHECK(with("<IPOC>", "<IPOC>1</IPOC><IPOC>") == TelegramFault::Duplicate);
  CHECK(with("<Sen ", "<Sen Type=\"ImFree\" ") == TelegramFault::Duplicate);
  for (const char* number :
       {"", "x", "nan", "inf", "-inf", "1e999", "0x10", "1,5", "1 2", "+-1", "--1", "1e", "\xC2\xB5"})
    CHECK(with("0.000000", number) == TelegramFault::BadNumber);
  for (const char* ipoc : {"", "x", "-1", "1.5", "99999999999999999999999"})
    CHECK(with(">0<", ">" + std::string(ipoc) + "<") == TelegramFault::BadIpoc);
  CHECK(with("<IPOC>0</IPOC>", "") == TelegramFault::NoIpoc);
  CHECK(with("A3=\"0.000000\"", "") == TelegramFault::Incomplete);
  Telegram t;
  CHECK(rob.decode("<Rob Type=\"KUKA\"><IPOC>77</IPOC></Rob>", t) == TelegramFault::Incomplete);  // a KR C2 begins so
  CHECK((t.ipoc.text() == "77" && t.present.none()));
}

TEST_CASE("values of a type are of that type") {
  TelegramLayout layout;
  layout.receive = {{.tag = "B", .type = ValueType::Bool, .index = 1},
                    {.tag = "L", .type = ValueType::Long, .index = 2}};
  const TelegramCodec codec(layout, Sender::Computer);
  const auto read = [&](const std::string& b, const std::string& l) {
    return fault_of(codec, "<Sen Type=\"ImFree\"><B>" + b + "</B><L>" + l + "</L><IPOC>1</IPOC></Sen>");
  };
  for (const char* b : {"0", "1", "TRUE", "FALSE", "true", "false"}) CHECK(read(b, "1") == TelegramFault::None);
  CHECK(read("2", "1") == TelegramFault::BadNumber);
  CHECK(read("1", "1.5") == TelegramFault::BadNumber);
  CHECK(read("1", "-7") == TelegramFault::None);
  CHECK(read("1", "9223372036854775807") == TelegramFault::BadNumber);
  CHECK(read("1", "99999999999999999999") == TelegramFault::BadNumber);
}

TEST_CASE("numbers are read to the nearest double, however they are written") {
  TelegramLayout layout;
  layout.receive = {{.tag = "V", .index = 1}};
  const TelegramCodec codec(layout, Sender::Computer);
  Random random(14);
  Telegram t;
  for (int i = 0; i < 20000; ++i) {
    std::array<char, 400> text;
    const double value = random.normal(std::pow(10, random.uniform(-6, 9)));
    const int digits = random.integer(18);
    std::snprintf(text.data(), text.size(), random.integer(2) ? "%.*f" : "%.*g", digits, value);
    REQUIRE(codec.decode("<Sen Type=\"ImFree\"><V>" + std::string(text.data()) + "</V><IPOC>1</IPOC></Sen>", t) ==
            TelegramFault::None);
    REQUIRE(t.values[0] == std::strtod(text.data(), nullptr));
  }
  for (const char* odd :
       {".5", "5.", "-.5", "0000000000000001", "123456789012345", "1234567890123456", "99999999999999.9"}) {
    REQUIRE(codec.decode("<Sen Type=\"ImFree\"><V>" + std::string(odd) + "</V><IPOC>1</IPOC></Sen>", t) ==
            TelegramFault::None);
    CHECK(t.values[0] == std::strtod(odd, nullptr));
  }
  for (const char* bad : {".", "-", "-.", "1.2.3", "..", "1-", "e5"})
    CHECK(codec.decode("<Sen Type=\"ImFree\"><V>" + std::string(bad) + "</V><IPOC>1</IPOC></Sen>", t) ==
          TelegramFault::BadNumber);
}

TEST_CASE("what cannot be written is not written") {
  const TelegramCodec codec(wire_layout("krc4_ros_rsi_ethernet.xml"), Sender::Computer);
  Telegram t;
  CHECK(encoded(codec, t).empty());  // without IPOC
  t.ipoc = Ipoc(std::uint64_t{1});
  const std::string good = encoded(codec, t);
  for (const double bad : std::initializer_list<double>{NAN, INFINITY, -INFINITY, 1.1e9, -1e300}) {
    t.values[3] = bad;
    CHECK(encoded(codec, t).empty());
  }
  t.values[3] = 0;
  for (std::size_t room = 0; room <= good.size(); ++room) {
    const std::unique_ptr<char[]> exact(new char[room]);  // its end is the end of what the sanitizer lets be written
    CHECK(codec.encode(t, {exact.get(), room}) == (room == good.size() ? good.size() : 0));
  }
  TelegramLayout two = book_layout();
  two.receive.push_back({.tag = "Text", .type = ValueType::String, .index = 30});
  CHECK_THROWS_AS(TelegramCodec(two, Sender::Computer), InvalidArgument);
}

/// What stands between the tags of IPOC, found without our codec; nothing unless there is exactly one.
std::string plain_ipoc(const std::string& text) {
  static const std::regex one("<IPOC\\s*>\\s*([0-9]+)\\s*</IPOC\\s*>");
  std::string found;
  for (std::sregex_iterator it(text.begin(), text.end(), one), end; it != end; ++it) {
    if (!found.empty()) return {};
    found = (*it)[1];
  }
  return found;
}

std::string mutated(std::string text, Random& random) {
  const int changes = 1 + random.integer(4);
  for (int i = 0; i < changes && !text.empty(); ++i) {
    const auto at = static_cast<std::size_t>(random.integer(static_cast<int>(text.size())));
    const auto other = static_cast<std::size_t>(random.integer(static_cast<int>(text.size())));
    switch (random.integer(6)) {
      case 0:
        text[at] = static_cast<char>(text[at] ^ (1 << random.integer(8)));
        break;
      case 1:
        text.resize(at);
        break;
      case 2:
        text.insert(at, 1, static_cast<char>(random.integer(256)));
        break;
      case 3:
        text.erase(at, 1 + static_cast<std::size_t>(random.integer(20)));
        break;
      case 4:
        text.insert(at, text.substr(other, static_cast<std::size_t>(random.integer(60))));
        break;
      default:
        text[at] = "<>/=\"' 0-."[random.integer(10)];
    }
  }
  return text;
}

TEST_CASE("damaged telegrams are survived, and no IPOC is read that does not stand there") {
  const TelegramLayout fzi = fzi_test_layout();
  const TelegramCodec rob(fzi, Sender::Controller), sen(fzi, Sender::Computer);
  Random random(3);
  TelegramCounts counts;
  long good = 0;
  for (int i = 0; i < 60000; ++i) {
    const bool from_controller = random.integer(2) == 0;
    const TelegramCodec& codec = from_controller ? rob : sen;
    const std::string text =
        mutated(wire_message(from_controller ? "fzi_parser_test_rob" : "fzi_writer_test_sen"), random);
    const std::unique_ptr<char[]> exact(new char[text.size()]);
    std::copy(text.begin(), text.end(), exact.get());
    Telegram t;
    const TelegramFault fault = codec.decode({exact.get(), text.size()}, t);
    counts.count(fault);
    if (fault != TelegramFault::None && fault != TelegramFault::Incomplete) continue;
    ++good;
    INFO(text);
    REQUIRE(t.ipoc.text() == plain_ipoc(std::regex_replace(text, std::regex("<!--[\\s\\S]*?-->"), "")));
    for (std::size_t k = 0; k < codec.fields().size(); ++k) REQUIRE(std::isfinite(t.values[k]));
  }
  CHECK(good > 1000);
  for (const TelegramFault kind :
       {TelegramFault::Foreign, TelegramFault::Truncated, TelegramFault::Malformed, TelegramFault::BadNumber,
        TelegramFault::BadIpoc, TelegramFault::Duplicate, TelegramFault::Incomplete, TelegramFault::NoIpoc})
    CHECK(counts.of(kind) > 0);
}

}  // namespace telegram_codec_test
