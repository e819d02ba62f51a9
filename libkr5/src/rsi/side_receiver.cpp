// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/side_receiver.hpp>

#include <algorithm>

namespace kr5::rsi {
namespace {

constexpr std::int64_t stretch = 10'000'000'000;  // in which clocks drift apart by less than a datagram takes [ns]
constexpr std::uint32_t window_size = 64;

std::size_t number_of(SideKind kind) noexcept { return kind == SideKind::Vision ? 0 : 1; }

}  // namespace

bool SideReceiver::take(std::string_view bytes, std::int64_t arrival) noexcept {
  SideMessage message;
  switch (decode_side(bytes, message)) {
    case SideFault::None:
      return take_good(streams_[number_of(message.kind)], message, arrival);
    case SideFault::Foreign:
      ++statistics_.foreign;
      return false;
    case SideFault::Version:
      ++statistics_.other_version;
      return false;
    default:
      ++statistics_.damaged;
      return false;
  }
}

void SideReceiver::note_offset(Stream& stream, std::int64_t offset, std::int64_t arrival) noexcept {
  if (arrival - stream.stretch_begin > stretch) {
    stream.offset = {offset, stream.offset[0]};
    stream.stretch_begin = arrival;
  }
  stream.offset[0] = std::min(stream.offset[0], offset);
}

void SideReceiver::begin(Stream& stream, const SideMessage& message, std::int64_t arrival) noexcept {
  if (stream.begun) ++statistics_.restarts;
  const std::uint32_t former = stream.begun ? stream.latest.source : message.source;
  const std::int64_t offset = arrival - message.sent;
  stream = {true, message, former, 1, {offset, offset}, arrival};
}

void SideReceiver::take_older(Stream& stream, std::uint32_t back) noexcept {
  const std::uint64_t bit = back < window_size ? std::uint64_t{1} << back : 0;
  if (stream.window & bit) {
    ++statistics_.repeated;
    return;
  }
  ++statistics_.reordered;
  if (bit == 0) return;
  stream.window |= bit;
  if (statistics_.lost > 0) --statistics_.lost;  // it has come after all
}

bool SideReceiver::take_good(Stream& stream, const SideMessage& message, std::int64_t arrival) noexcept {
  ++statistics_.received;
  if (!stream.begun) return begin(stream, message, arrival), true;
  if (message.source != stream.latest.source) {
    if (message.source == stream.former_source) return ++statistics_.reordered, false;
    return begin(stream, message, arrival), true;
  }
  note_offset(stream, arrival - message.sent, arrival);
  const std::uint32_t ahead = message.sequence - stream.latest.sequence;
  if (ahead == 0 || ahead >= 1U << 31) return take_older(stream, -ahead), false;
  statistics_.lost += ahead - 1;
  stream.window = ahead < window_size ? stream.window << ahead | 1 : 1;
  stream.latest = message;
  return true;
}

const SideMessage* SideReceiver::latest(SideKind kind) const noexcept {
  const Stream& stream = streams_[number_of(kind)];
  return stream.begun ? &stream.latest : nullptr;
}

std::optional<double> SideReceiver::age(SideKind kind, std::int64_t now) const noexcept {
  const Stream& stream = streams_[number_of(kind)];
  if (!stream.begun) return std::nullopt;
  const std::int64_t offset = std::min(stream.offset[0], stream.offset[1]);
  return 1e-9 * static_cast<double>(now - (stream.latest.time + offset));
}

}  // namespace kr5::rsi
