// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <kr5/core/fields.hpp>
#include <kr5/rsi/telegram_layout.hpp>

/// @file
/// The values of one telegram, in the units of the wire, and what can be wrong with one. Of fixed size: copying them
/// allocates nothing and throws nothing.

namespace kr5::rsi {

/// Longest telegram [bytes].
inline constexpr std::size_t max_telegram = 8192;

/// The cycle stamp of the controller. Its text goes back as it came; 1 to 20 digits.
class Ipoc {
 public:
  Ipoc() = default;
  explicit Ipoc(std::uint64_t value) noexcept;
  /// Nothing but digits that make a number of 64 bits; anything else leaves it empty.
  explicit Ipoc(std::string_view digits) noexcept;

  bool empty() const noexcept { return size_ == 0; }
  std::string_view text() const noexcept { return {text_.data(), size_}; }
  std::uint64_t value() const noexcept { return value_; }  ///< Mostly milliseconds.

  friend bool operator==(const Ipoc& a, const Ipoc& b) noexcept { return a.text() == b.text(); }

 private:
  std::array<char, 20> text_{};
  std::uint8_t size_ = 0;
  std::uint64_t value_ = 0;
};

/// Milliseconds from one stamp to another, less than zero for one that is older; stamps begin again at 2^32.
std::int64_t ipoc_step(const Ipoc& before, const Ipoc& now) noexcept;

/// A text of the controller or for it, at most 127 characters.
class MessageText {
 public:
  MessageText() = default;
  explicit MessageText(std::string_view text) noexcept;
  std::string_view text() const noexcept { return {text_.data(), size_}; }

 private:
  std::array<char, 127> text_{};
  std::uint8_t size_ = 0;
};

struct Telegram {
  std::array<double, max_values> values{};  ///< In the order of `telegram_fields`.
  std::bitset<max_values> present;          ///< Those that stood in it.
  MessageText message;                      ///< Of the element whose type is a text.
  Ipoc ipoc;
  int unknown = 0;  ///< Elements and attributes that the layout does not know.
};

/// What is wrong with a telegram.
enum class TelegramFault {
  None,
  Empty,       ///< No bytes.
  TooLong,     ///< More than `max_telegram`.
  Foreign,     ///< Of another kind: no <Rob Type="KUKA">, or a <Sen> of another Type.
  Truncated,   ///< It ends before its end.
  Malformed,   ///< It is no XML of the form of a telegram.
  Duplicate,   ///< An element or attribute is there twice.
  BadNumber,   ///< A value is no finite number of its type.
  BadIpoc,     ///< IPOC is no number.
  NoIpoc,      ///< IPOC is missing.
  Incomplete,  ///< Values of the layout are missing; everything that is there is good, IPOC too.
};
constexpr auto enum_names(TelegramFault) {
  using enum TelegramFault;
  return names<TelegramFault>({{None, "none"},
                               {Empty, "empty"},
                               {TooLong, "too_long"},
                               {Foreign, "foreign"},
                               {Truncated, "truncated"},
                               {Malformed, "malformed"},
                               {Duplicate, "duplicate"},
                               {BadNumber, "bad_number"},
                               {BadIpoc, "bad_ipoc"},
                               {NoIpoc, "no_ipoc"},
                               {Incomplete, "incomplete"}});
}

/// Telegrams by what was wrong with them.
struct TelegramCounts {
  std::uint64_t good = 0;
  std::uint64_t empty = 0;
  std::uint64_t too_long = 0;
  std::uint64_t foreign = 0;
  std::uint64_t truncated = 0;
  std::uint64_t malformed = 0;
  std::uint64_t duplicate = 0;
  std::uint64_t bad_number = 0;
  std::uint64_t bad_ipoc = 0;
  std::uint64_t no_ipoc = 0;
  std::uint64_t incomplete = 0;

  void count(TelegramFault fault) noexcept { ++of(fault); }
  std::uint64_t& of(TelegramFault fault) noexcept;
  /// All but the good ones.
  std::uint64_t faulty() const noexcept;

  static void each_field(auto& self, auto&& visit) {
    visit("good", self.good, "Telegrams without a fault.");
    visit("empty", self.empty, "Datagrams without bytes.");
    visit("too_long", self.too_long, "Telegrams of more than 8192 bytes.");
    visit("foreign", self.foreign, "Telegrams of another kind or Type.");
    visit("truncated", self.truncated, "Telegrams that end before their end.");
    visit("malformed", self.malformed, "What is no XML of the form of a telegram.");
    visit("duplicate", self.duplicate, "Telegrams with an element or attribute twice.");
    visit("bad_number", self.bad_number, "Telegrams with a value that is no finite number of its type.");
    visit("bad_ipoc", self.bad_ipoc, "Telegrams whose IPOC is no number.");
    visit("no_ipoc", self.no_ipoc, "Telegrams without IPOC.");
    visit("incomplete", self.incomplete, "Telegrams that lack values of the layout.");
  }
};

}  // namespace kr5::rsi
