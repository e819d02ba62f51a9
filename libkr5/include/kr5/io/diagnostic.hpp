// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <kr5/core/fields.hpp>

namespace kr5::io {

enum class Severity {
  Error,    ///< The file cannot be used: loading it fails.
  Warning,  ///< Probably a mistake, such as another unit; the file can be used.
};
constexpr auto enum_names(Severity) {
  return names<Severity>({{Severity::Error, "error"}, {Severity::Warning, "warning"}});
}

/// One error or warning about a file, with its place and remedy.
struct Diagnostic {
  std::string file;
  int line = 0;
  std::string field;     ///< Dotted path, e.g. `robot.dh[2].alpha`.
  std::string found;     ///< The value as written.
  std::string expected;  ///< What should stand there, and the remedy.
  Severity severity = Severity::Error;

  /// `file:line: field: found ..., expected ...`; long parts are shortened.
  std::string text() const;

  static void each_field(auto& self, auto&& visit) {
    visit("file", self.file, "Name of the file.");
    visit("line", self.line, "Line in the file, from 1; 0 for the file as a whole.");
    visit("field", self.field, "Dotted path of the field.");
    visit("found", self.found, "Value as written.");
    visit("expected", self.expected, "Expected value, and the remedy.");
    visit("severity", self.severity, "Severity: error (the file cannot be used) | warning.");
  }
};

/// @throws IoError with the errors, one a line (of very many the first), when there are any.
void throw_diagnostics(std::span<const Diagnostic> diagnostics);

/// The text, or its beginning and "...", cut between characters of UTF-8.
std::string shortened(std::string_view text, std::size_t length = 80);

/// The name of `known` that `word` was probably meant to be, or nothing.
std::string nearest_name(const std::string& word, std::span<const std::string> known);

}  // namespace kr5::io
