// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/io/problem.hpp>

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

std::string Problem::text() const {
  std::string out = file;
  if (line > 0) out += ":" + std::to_string(line);
  out += ": ";
  if (!field.empty()) out += field + ": ";
  return out + "found " + found + ", expected " + expected;
}

void throw_problems(std::span<const Problem> problems) {
  constexpr std::size_t most = 50;  // a wrong separator spoils every row; nobody reads ten thousand complaints
  if (problems.empty()) return;
  std::string text;
  for (const Problem& p : problems.first(std::min(most, problems.size())))
    text += (text.empty() ? "" : "\n") + p.text();
  if (problems.size() > most) text += "\nand " + std::to_string(problems.size() - most) + " more";
  throw IoError(text);
}

std::string nearest_name(const std::string& word, std::span<const std::string> known) {
  const auto distance = [&](const std::string& name) { return edit_distance(word, name); };
  const auto near = std::min_element(known.begin(), known.end(),
                                     [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  return near != known.end() && distance(*near) <= (near->size() + 1) / 3 ? *near : "";
}

}  // namespace kr5::io
