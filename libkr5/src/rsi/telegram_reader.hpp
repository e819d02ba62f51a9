// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bitset>
#include <string_view>

#include <kr5/rsi/telegram_codec.hpp>

namespace kr5::rsi {

/// Reads one telegram from its first byte to its last.
class TelegramReader {
 public:
  TelegramReader(const TelegramCodec& codec, std::string_view bytes, Telegram& out) noexcept
      : codec_(codec), left_(bytes), out_(out) {}

  TelegramFault read() noexcept;

 private:
  using Element = TelegramCodec::Element;
  using Attribute = TelegramCodec::Attribute;

  bool fail(TelegramFault fault) noexcept;
  void skip_blanks() noexcept;
  bool skip_past(std::string_view end) noexcept;
  bool expect(char c) noexcept;
  bool name(std::string_view& out) noexcept;
  bool quoted(std::string_view& out) noexcept;
  bool attribute(std::string_view& name, std::string_view& value) noexcept;
  bool tag_end(bool& closed) noexcept;
  bool closing(std::string_view name) noexcept;
  bool text(std::string_view& out) noexcept;

  bool root() noexcept;
  bool children() noexcept;
  bool child(std::string_view name) noexcept;
  bool ipoc() noexcept;
  bool known(const Element& element) noexcept;
  bool unknown(std::string_view name) noexcept;
  bool set(const Attribute& attribute, std::string_view text) noexcept;
  const Element* find(std::string_view name) noexcept;

  const TelegramCodec& codec_;
  std::string_view left_;
  Telegram& out_;
  TelegramFault fault_ = TelegramFault::None;
  std::size_t expected_ = 0;  ///< Element that probably comes next.
  std::bitset<max_values> seen_;
};

}  // namespace kr5::rsi
