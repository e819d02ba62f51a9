// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/io/diagnostic.hpp>
#include <kr5/io/node.hpp>

namespace kr5::cell {

/// Collects diagnostics of a document; line and text of each field are found by its path.
class DiagnosticCollector {
 public:
  DiagnosticCollector(std::string file, const io::Node& root, io::Severity severity = io::Severity::Error)
      : file_(std::move(file)), root_(root), severity_(severity) {}

  /// `field` such as `robot.dh[2].alpha`. Without `found` the text of the document is shown.
  void add(const std::string& field, const std::string& expected, std::string found = "");
  /// add() unless `condition` holds.
  void expect(bool condition, const std::string& field, const std::string& expected, std::string found = "") {
    if (!condition) add(field, expected, std::move(found));
  }
  std::vector<io::Diagnostic> take() { return std::move(diagnostics_); }

 private:
  std::string file_;
  const io::Node& root_;
  io::Severity severity_;
  std::vector<io::Diagnostic> diagnostics_;
};

/// Length that no link, tool or cell exceeds [m].
inline constexpr double long_arm = 10.0;

/// `a, b, c`
std::string listed(const std::vector<std::string>& names);
/// `name[3]`
std::string item(const std::string& name, Eigen::Index index);
/// Shortest text of a number.
std::string text_of(double value);
/// The same to six digits, for measured values.
std::string rounded_text(double value);

}  // namespace kr5::cell
