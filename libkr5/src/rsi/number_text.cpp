// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/number_text.hpp"

#include <array>
#include <charconv>

namespace kr5::rsi {

std::string number_text(double value) {
  std::array<char, 400> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, 4).ptr;
  std::string out(text.data(), end);
  while (out.back() == '0') out.pop_back();
  if (out.back() == '.') out.pop_back();
  return out == "-0" ? "0" : out;
}

}  // namespace kr5::rsi
