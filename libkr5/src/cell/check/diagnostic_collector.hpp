// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include <kr5/io/diagnostic.hpp>
#include <kr5/io/node.hpp>

namespace kr5::cell {

/// Path of a field, such as `robot.dh[2].alpha`, of texts that outlive it; put together only where something is wrong,
/// because simulators check a cell before each prediction.
class FieldPath {
 public:
  FieldPath(const char* name) : list_(name) {}
  FieldPath(const std::string& name) : list_(name) {}
  FieldPath(std::string_view list, Eigen::Index index, std::string_view rest = {})
      : list_(list), rest_(rest), index_(index) {}

  std::string text() const;

 private:
  std::string_view list_, rest_;
  Eigen::Index index_ = -1;
};

/// Collects diagnostics of a document; line and text of each field are found by its path.
class DiagnosticCollector {
 public:
  DiagnosticCollector(std::string file, const io::Node& root, io::Severity severity = io::Severity::Error)
      : file_(std::move(file)), root_(root), severity_(severity) {}

  /// `field` such as `robot.dh[2].alpha`. Without `found` the text of the document is shown.
  void add(const std::string& field, const std::string& expected, std::string found = "");
  /// add() unless `condition` holds.
  /// @param expected, found A text, or a function that makes it.
  template <class Expected, class Found = const char*>
  void expect(bool condition, const FieldPath& field, const Expected& expected, const Found& found = "") {
    if (!condition) add(field.text(), made(expected), made(found));
  }
  std::vector<io::Diagnostic> take() { return std::move(diagnostics_); }

 private:
  template <class Text>
  static std::string made(const Text& text) {
    if constexpr (std::is_invocable_v<Text>)
      return text();
    else
      return text;
  }

  std::string file_;
  const io::Node& root_;
  io::Severity severity_;
  std::vector<io::Diagnostic> diagnostics_;
};

/// Length that no link, tool or cell exceeds [m].
inline constexpr double long_arm = 10.0;
/// Angle that no joint with limits reaches [rad].
inline constexpr double many_turns = 50.0;

/// `a, b, c`
std::string listed(const std::vector<std::string>& names);
/// `name[3]`
std::string item(const std::string& name, Eigen::Index index);
/// Shortest text of a number.
std::string text_of(double value);
/// The same to six digits, for measured values.
std::string rounded_text(double value);

}  // namespace kr5::cell
