// SPDX-License-Identifier: BSD-3-Clause
#include "io/utf8.hpp"

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
  const auto length = static_cast<std::size_t>(std::countl_one(byte(0)));
  if (length == 0) return 1;
  if (length < 2 || length > 4 || text.size() < length) return 0;
  std::uint32_t code = byte(0) & (0xFFu >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0u) != 0x80u) return 0;
    code = code << 6 | (byte(i) & 0x3Fu);
  }
  constexpr std::uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  const bool no_character = (code & 0xFFFEu) == 0xFFFEu || (code >= 0xFDD0 && code <= 0xFDEF);
  return code < least[length] || code > 0x10FFFF || surrogate || no_character ? 0 : length;
}

/// The text begins with a control character that YAML wants written as an escape.
bool is_control(std::string_view text) {
  const auto first = static_cast<std::uint8_t>(text[0]);
  if (first == 0xC2) return static_cast<std::uint8_t>(text[1]) < 0xA0;
  const bool line_end = first == '\n' || text.starts_with("\r\n");  // yaml-cpp takes a lone CR as part of a word
  return (first < 0x20 && first != '\t' && !line_end) || first == 0x7F;
}

}  // namespace

bool is_utf8(std::string_view text) {
  const auto ascii = [](char c) { return static_cast<unsigned char>(c) < 0x80; };
  if (std::all_of(text.begin(), text.end(), ascii)) return true;
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

void require_utf8(std::string_view text, const std::string& source) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = character_length(text.substr(at));
    if (length == 0 || is_control(text.substr(at))) {
      char byte[8];
      std::snprintf(byte, sizeof byte, "0x%02X", static_cast<unsigned>(static_cast<std::uint8_t>(text[at])));
      const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') + 1;
      throw IoError(source + ":" + std::to_string(line) + ": found the byte " + byte +
                    ", which is not UTF-8 text; expected a text file saved as UTF-8");
    }
    at += length;
  }
}

}  // namespace kr5::io
