// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/telegram.hpp>

#include <algorithm>
#include <charconv>

namespace kr5::rsi {

Ipoc::Ipoc(std::uint64_t value) noexcept : value_(value) {
  const auto end = std::to_chars(text_.data(), text_.data() + text_.size(), value).ptr;
  size_ = static_cast<std::uint8_t>(end - text_.data());
}

Ipoc::Ipoc(std::string_view digits) noexcept {
  const char* end = digits.data() + digits.size();
  std::uint64_t value = 0;
  if (digits.size() > text_.size()) return;
  const auto [stop, error] = std::from_chars(digits.data(), end, value);  // takes no sign and no blank
  if (error != std::errc() || stop != end) return;
  std::copy(digits.begin(), digits.end(), text_.begin());
  size_ = static_cast<std::uint8_t>(digits.size());
  value_ = value;
}

std::int64_t ipoc_step(const Ipoc& before, const Ipoc& now) noexcept {
  constexpr std::uint64_t wrap = 1ULL << 32;
  if (now.value() >= wrap || before.value() >= wrap) return static_cast<std::int64_t>(now.value() - before.value());
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(now.value()) -
                                   static_cast<std::uint32_t>(before.value()));
}

MessageText::MessageText(std::string_view text) noexcept {
  size_ = static_cast<std::uint8_t>(std::min(text.size(), text_.size()));
  std::copy_n(text.begin(), size_, text_.begin());
}

std::uint64_t& TelegramCounts::of(TelegramFault fault) noexcept {
  switch (fault) {
    case TelegramFault::None:
      return good;
    case TelegramFault::Empty:
      return empty;
    case TelegramFault::TooLong:
      return too_long;
    case TelegramFault::Foreign:
      return foreign;
    case TelegramFault::Truncated:
      return truncated;
    case TelegramFault::Malformed:
      return malformed;
    case TelegramFault::Duplicate:
      return duplicate;
    case TelegramFault::BadNumber:
      return bad_number;
    case TelegramFault::BadIpoc:
      return bad_ipoc;
    case TelegramFault::NoIpoc:
      return no_ipoc;
    case TelegramFault::Incomplete:
      return incomplete;
  }
  return malformed;
}

std::uint64_t TelegramCounts::faulty() const noexcept {
  return empty + too_long + foreign + truncated + malformed + duplicate + bad_number + bad_ipoc + no_ipoc + incomplete;
}

}  // namespace kr5::rsi
