// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/side_message.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace kr5::rsi {
namespace {

constexpr std::string_view side_mark = "KR5S";
constexpr std::uint8_t side_version = 1;
constexpr std::size_t head_size = 32, checksum_size = 4;

constexpr std::array<std::uint32_t, 256> crc_table = [] {
  std::array<std::uint32_t, 256> out{};
  for (std::uint32_t i = 0; i < out.size(); ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = (c >> 1) ^ ((c & 1) ? 0xEDB88320U : 0U);
    out[i] = c;
  }
  return out;
}();

std::uint32_t crc32(std::string_view bytes) noexcept {
  std::uint32_t c = ~0U;
  for (const char byte : bytes) c = crc_table[(c ^ static_cast<unsigned char>(byte)) & 0xFF] ^ (c >> 8);
  return ~c;
}

std::size_t values_size(SideKind kind) noexcept { return kind == SideKind::Vision ? 120 : 56; }

/// Numbers one after the other into a space that is known to suffice.
class SideWriter {
 public:
  explicit SideWriter(char* at) noexcept : at_(at) {}
  template <class T>
  void whole(T value) noexcept {
    for (std::size_t i = 0; i < sizeof(T); ++i)
      *at_++ = static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i));
  }
  void real(double value) noexcept { whole(std::bit_cast<std::uint64_t>(value)); }
  void reals(const auto& values) noexcept {
    for (const double value : values) real(value);
  }

 private:
  char* at_;
};

class SideReader {
 public:
  explicit SideReader(const char* at) noexcept : at_(at) {}
  template <class T>
  T whole() noexcept {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) value |= std::uint64_t{static_cast<unsigned char>(*at_++)} << (8 * i);
    return static_cast<T>(value);
  }
  double real() noexcept { return std::bit_cast<double>(whole<std::uint64_t>()); }
  template <int n>
  Eigen::Matrix<double, n, 1> reals() noexcept {
    Eigen::Matrix<double, n, 1> out;
    for (double& value : out) value = real();
    return out;
  }

 private:
  const char* at_;
};

bool is_good(const VisionResult& v) noexcept {
  return v.T_base_target.matrix().allFinite() && is_rotation(v.T_base_target.linear()) && v.std.allFinite() &&
         std::isfinite(v.quality);
}

void write_vision(SideWriter& to, const VisionResult& v) noexcept {
  const Eigen::Quaterniond q(v.T_base_target.linear());
  to.whole(v.target);
  to.whole<std::uint32_t>(v.found ? 1 : 0);
  to.reals(Eigen::Vector3d(v.T_base_target.translation()));
  to.reals(std::array{q.w(), q.x(), q.y(), q.z()});
  to.reals(v.std);
  to.real(v.quality);
}

bool read_vision(SideReader& from, VisionResult& v) noexcept {
  v.target = from.whole<std::int32_t>();
  v.found = (from.whole<std::uint32_t>() & 1U) != 0;
  const Eigen::Vector3d position = from.reals<3>();
  const Eigen::Vector4d wxyz = from.reals<4>();
  v.std = from.reals<6>();
  v.quality = from.real();
  constexpr double tolerance = 1e-6;
  if (!wxyz.allFinite() || std::abs(wxyz.norm() - 1.0) > tolerance) return false;
  v.T_base_target.translation() = position;
  v.T_base_target.linear() = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized().toRotationMatrix();
  return is_good(v);
}

}  // namespace

std::size_t encode_side(const SideMessage& m, std::span<char> out) noexcept {
  const std::size_t values = values_size(m.kind), size = head_size + values + checksum_size;
  if (out.size() < size || !(m.kind == SideKind::Vision ? is_good(m.vision) : m.force.wrench.allFinite())) return 0;
  std::ranges::copy(side_mark, out.begin());
  SideWriter to(out.data() + side_mark.size());
  to.whole(side_version);
  to.whole(static_cast<std::uint8_t>(m.kind));
  to.whole(static_cast<std::uint16_t>(values));
  to.whole(m.source);
  to.whole(m.sequence);
  to.whole(m.time);
  to.whole(m.sent);
  if (m.kind == SideKind::Vision) {
    write_vision(to, m.vision);
  } else {
    to.whole<std::uint32_t>(m.force.saturated ? 1 : 0);
    to.whole<std::uint32_t>(0);
    to.reals(m.force.wrench);
  }
  to.whole(crc32({out.data(), head_size + values}));
  return size;
}

SideFault decode_side(std::string_view bytes, SideMessage& out) noexcept {
  if (!bytes.starts_with(side_mark)) return SideFault::Foreign;
  if (bytes.size() <= side_mark.size()) return SideFault::Size;
  SideReader from(bytes.data() + side_mark.size());
  if (from.whole<std::uint8_t>() != side_version) return SideFault::Version;
  if (bytes.size() < head_size + checksum_size) return SideFault::Size;
  const auto kind = from.whole<std::uint8_t>();
  const std::size_t values = from.whole<std::uint16_t>();
  if (bytes.size() != head_size + values + checksum_size) return SideFault::Size;
  SideReader sum(bytes.data() + head_size + values);
  if (sum.whole<std::uint32_t>() != crc32(bytes.substr(0, head_size + values))) return SideFault::Checksum;
  if (kind != 1 && kind != 2) return SideFault::Kind;
  SideMessage m;
  m.kind = static_cast<SideKind>(kind);
  if (values != values_size(m.kind)) return SideFault::Size;
  m.source = from.whole<std::uint32_t>();
  m.sequence = from.whole<std::uint32_t>();
  m.time = from.whole<std::int64_t>();
  m.sent = from.whole<std::int64_t>();
  if (m.kind == SideKind::Vision) {
    if (!read_vision(from, m.vision)) return SideFault::Value;
  } else {
    m.force.saturated = (from.whole<std::uint32_t>() & 1U) != 0;
    from.whole<std::uint32_t>();
    m.force.wrench = from.reals<6>();
    if (!m.force.wrench.allFinite()) return SideFault::Value;
  }
  out = m;
  return SideFault::None;
}

}  // namespace kr5::rsi
