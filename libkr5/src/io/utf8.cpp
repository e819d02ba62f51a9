// SPDX-License-Identifier: BSD-3-Clause
#include "utf8.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdio>

#include <kr5/core/error.hpp>

namespace kr5::io {
namespace {

/// Length in bytes of the character at the front of the text; 0 when there is no valid one.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const int ones = std::countl_one(byte(0));
  if (ones == 0) {
    const bool line_end = byte(0) == '\n' || text.starts_with("\r\n");  // yaml-cpp takes a lone CR as part of a word
    const bool printable = (byte(0) >= 0x20 && byte(0) != 0x7F) || byte(0) == '\t' || line_end;
    return printable ? 1 : 0;
  }
  const auto length = static_cast<std::size_t>(ones);
  if (length < 2 || length > 4 || text.size() < length) return 0;
  std::uint32_t code = byte(0) & (0xFFu >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0u) != 0x80u) return 0;
    code = code << 6 | (byte(i) & 0x3Fu);
  }
  constexpr std::uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool control = code < 0xA0 && code != 0x85;
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  const bool no_character = (code & 0xFFFEu) == 0xFFFEu || (code >= 0xFDD0 && code <= 0xFDEF);
  return code < least[length] || code > 0x10FFFF || control || surrogate || no_character ? 0 : length;
}

}  // namespace

void require_utf8(std::string_view text, const std::string& source) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = character_length(text.substr(at));
    if (length == 0) {
      char byte[8];
      std::snprintf(byte, sizeof byte, "0x%02X", static_cast<unsigned>(static_cast<std::uint8_t>(text[at])));
      const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') + 1;
      throw IoError(source + ":" + std::to_string(line) + ": found the byte " + byte +
                    ", which is no text; expected a text file saved as UTF-8");
    }
    at += length;
  }
}

}  // namespace kr5::io
