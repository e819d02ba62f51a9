// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/io/diagnostic.hpp>

#include <algorithm>

#include <kr5/core/error.hpp>

namespace kr5::io {
namespace {

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({change, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string shortened(std::string_view text, std::size_t length) {
  if (text.size() <= length) return std::string(text);
  const auto continues = [&](std::size_t at) { return (static_cast<unsigned char>(text[at]) & 0xC0u) == 0x80u; };
  while (length > 0 && continues(length)) --length;
  return std::string(text.substr(0, length)) + "...";
}

std::string Diagnostic::text() const {
  constexpr std::size_t most_field = 120, most_found = 300, most_expected = 600;
  std::string out = file;
  if (line > 0) out += ":" + std::to_string(line);
  out += ": ";
  if (!field.empty()) out += shortened(field, most_field) + ": ";
  return out + "found " + shortened(found, most_found) + ", expected " + shortened(expected, most_expected);
}

void throw_diagnostics(std::span<const Diagnostic> diagnostics) {
  constexpr std::size_t most = 50;  // a wrong separator spoils every row; nobody reads ten thousand errors
  std::string text;
  std::size_t count = 0;
  for (const Diagnostic& d : diagnostics)
    if (d.severity == Severity::Error && ++count <= most) text += (text.empty() ? "" : "\n") + d.text();
  if (count == 0) return;
  if (count > most) text += "\nand " + std::to_string(count - most) + " more";
  throw IoError(text);
}

std::string nearest_name(const std::string& word, std::span<const std::string> known) {
  constexpr std::size_t longest = 64;  // no name is longer, and the distance takes the product of the lengths
  if (word.size() > longest) return "";
  const auto distance = [&](const std::string& name) { return edit_distance(word, name); };
  const auto near = std::min_element(known.begin(), known.end(),
                                     [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  return near != known.end() && distance(*near) <= (near->size() + 1) / 3 ? *near : "";
}

}  // namespace kr5::io
