// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

namespace kr5::io {

/// One thing wrong with a file.
struct Problem {
  std::string file;
  int line = 0;
  std::string field;     ///< Dotted path, e.g. `robot.dh[2].alpha`.
  std::string found;     ///< The value as written.
  std::string expected;  ///< What should stand there, and the remedy.

  /// `file:line: field: found ..., expected ...`
  std::string text() const;

  static void each_field(auto& self, auto&& visit) {
    visit("file", self.file, "The file.");
    visit("line", self.line, "Line in the file, from 1; 0 when the file as a whole is meant.");
    visit("field", self.field, "Dotted path of the field.");
    visit("found", self.found, "The value as written.");
    visit("expected", self.expected, "What should stand there.");
  }
};

/// @throws IoError with the problems, one a line (of very many the first), when there are any.
void throw_problems(std::span<const Problem> problems);

/// The name of `known` that `word` was probably meant to be, or nothing.
std::string nearest_name(const std::string& word, std::span<const std::string> known);

}  // namespace kr5::io
