#include <kr5/rsi/side_message.hpp>

#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>

#include <catch2/catch.hpp>

#include <kr5/core/random.hpp>

using namespace kr5;
using namespace kr5::rsi;

namespace side_message_test {

std::string encoded(const SideMessage& m) {
  std::array<char, max_side_message> out;
  return {out.data(), encode_side(m, out)};
}

SideMessage vision(Random& random) {
  SideMessage m;
  m.kind = SideKind::Vision;
  m.source = static_cast<std::uint32_t>(random.engine()());
  m.sequence = static_cast<std::uint32_t>(random.engine()());
  m.time = static_cast<std::int64_t>(random.engine()());
  m.sent = static_cast<std::int64_t>(random.engine()());
  m.vision.target = random.integer(1000) - 500;
  m.vision.found = random.integer(2) == 0;
  m.vision.T_base_target = to_pose(random.normal_vector(6, 1.0));
  m.vision.std = random.normal_vector(6, 1e-3);
  m.vision.quality = random.uniform();
  return m;
}

TEST_CASE("results go through a datagram and come out as they were") {
  Random random(8);
  for (int i = 0; i < 100; ++i) {
    const SideMessage m = vision(random);
    SideMessage back;
    REQUIRE(decode_side(encoded(m), back) == SideFault::None);
    CHECK((back.source == m.source && back.sequence == m.sequence && back.time == m.time && back.sent == m.sent));
    CHECK((back.vision.target == m.vision.target && back.vision.found == m.vision.found));
    CHECK((back.vision.T_base_target.matrix() - m.vision.T_base_target.matrix()).norm() < 1e-14);
    CHECK((back.vision.std == m.vision.std && back.vision.quality == m.vision.quality));
    SideMessage f;
    f.kind = SideKind::Force;
    f.force = {random.normal_vector(6, 10.0), i % 2 == 0};
    REQUIRE(decode_side(encoded(f), back) == SideFault::None);
    CHECK(
        (back.kind == SideKind::Force && back.force.wrench == f.force.wrench && back.force.saturated == (i % 2 == 0)));
  }
}

TEST_CASE("the bytes stand where the description says") {
  SideMessage f;
  f.kind = SideKind::Force;
  f.source = 0x01020304;
  f.sequence = 0x0A0B0C0D;
  f.time = 0x1122334455667788;
  f.force.wrench[0] = 1.0;
  const std::string bytes = encoded(f);
  REQUIRE(bytes.size() == 32 + 56 + 4);
  CHECK(bytes.substr(0, 8) == std::string("KR5S\x01\x02\x38\x00", 8));
  CHECK(bytes.substr(8, 8) == "\x04\x03\x02\x01\x0D\x0C\x0B\x0A");
  CHECK(bytes.substr(16, 8) == "\x88\x77\x66\x55\x44\x33\x22\x11");
  CHECK(bytes.substr(40, 8) == std::string("\0\0\0\0\0\0\xF0\x3F", 8));
  std::uint32_t crc = ~0U;  // IEEE 802.3, bit by bit
  for (std::size_t i = 0; i + 4 < bytes.size(); ++i) {
    crc ^= static_cast<unsigned char>(bytes[i]);
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ (0xEDB88320U & (0U - (crc & 1U)));
  }
  crc = ~crc;
  CHECK(std::memcmp(bytes.data() + 88, &crc, 4) == 0);
}

TEST_CASE("every damage of up to three bits, any cut and any addition is noticed") {
  Random random(9);
  const std::string good = encoded(vision(random));
  REQUIRE(good.size() == max_side_message);
  for (int i = 0; i < 20000; ++i) {
    std::string bad = good;
    const int flips = 1 + random.integer(3);
    for (int k = 0; k < flips; ++k) {
      const int bit = random.integer(static_cast<int>(8 * bad.size()));
      bad[static_cast<std::size_t>(bit / 8)] =
          static_cast<char>(bad[static_cast<std::size_t>(bit / 8)] ^ (1 << bit % 8));
    }
    SideMessage out;
    if (bad != good) REQUIRE(decode_side(bad, out) != SideFault::None);
  }
  for (std::size_t size = 0; size < good.size(); ++size) {
    SideMessage out;
    const std::unique_ptr<char[]> exact(new char[size]);
    std::copy_n(good.begin(), size, exact.get());
    CHECK(decode_side({exact.get(), size}, out) != SideFault::None);
  }
  SideMessage out;
  CHECK(decode_side(good + "x", out) == SideFault::Size);
}

/// A datagram with another byte, its checksum made right again.
std::string forged(std::string bytes, std::size_t at, const std::string& with) {
  bytes.replace(at, with.size(), with);
  std::uint32_t crc = ~0U;
  for (std::size_t i = 0; i + 4 < bytes.size(); ++i) {
    crc ^= static_cast<unsigned char>(bytes[i]);
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ (0xEDB88320U & (0U - (crc & 1U)));
  }
  crc = ~crc;
  std::memcpy(bytes.data() + bytes.size() - 4, &crc, 4);
  return bytes;
}

TEST_CASE("faults have their kinds") {
  Random random(10);
  const std::string good = encoded(vision(random));
  const double nothing = NAN;
  const std::string nan(reinterpret_cast<const char*>(&nothing), 8);
  SideMessage out;
  CHECK(decode_side("", out) == SideFault::Foreign);
  CHECK(decode_side("KR5", out) == SideFault::Foreign);
  CHECK(decode_side("KR5S", out) == SideFault::Size);
  CHECK(decode_side("HTTP/1.1", out) == SideFault::Foreign);
  CHECK(decode_side(forged(good, 4, "\x02"), out) == SideFault::Version);
  CHECK(decode_side(forged(good, 5, "\x03"), out) == SideFault::Kind);
  CHECK(decode_side(forged(good, 5, "\x02"), out) == SideFault::Size);
  CHECK(decode_side(forged(good, 40, nan), out) == SideFault::Value);
  CHECK(decode_side(forged(good, 64, nan), out) == SideFault::Value);
  CHECK(decode_side(forged(good, 64, std::string(32, '\0')), out) == SideFault::Value);
  CHECK(decode_side(forged(good, 96, nan), out) == SideFault::Value);
}

TEST_CASE("what is no finite result is not sent") {
  std::array<char, max_side_message> out;
  SideMessage m;
  m.vision.T_base_target(0, 3) = NAN;
  CHECK(encode_side(m, out) == 0);
  m.vision.T_base_target = Pose::Identity();
  m.vision.T_base_target.linear() *= 2;
  CHECK(encode_side(m, out) == 0);
  m.vision = {};
  m.vision.std[5] = INFINITY;
  CHECK(encode_side(m, out) == 0);
  m.vision = {};
  CHECK(encode_side(m, std::span(out).first(100)) == 0);
  m.kind = SideKind::Force;
  m.force.wrench[2] = NAN;
  CHECK(encode_side(m, out) == 0);
}

}  // namespace side_message_test
