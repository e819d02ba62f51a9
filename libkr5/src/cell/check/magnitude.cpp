// SPDX-License-Identifier: BSD-3-Clause
#include "cell/check/magnitude.hpp"

#include <cmath>
#include <map>
#include <string_view>

#include <kr5/io/reader.hpp>

namespace kr5::cell {
namespace {

/// Greatest magnitude of a number of each unit: far beyond any cell, and far below what overflows in a simulation.
double greatest(std::string_view unit) {
  static const std::map<std::string_view, double> table = {
      {"m", 1e3},  {"rad", 1e4},   {"rad or m", 1e4}, {"rad/s", 1e4}, {"rad/s or m/s", 1e4}, {"s", 1e2},
      {"kg", 1e5}, {"m/s^2", 1e3}, {"-", 1e5},        {"px", 1e6},    {"N/m", 1e9},          {"kg m^2", 1e6}};
  const auto found = table.find(unit);
  return found == table.end() ? 1e7 : found->second;
}

/// What stands in the last brackets of a field's documentation.
std::string_view unit_of(std::string_view doc) {
  const std::size_t begin = doc.rfind('['), end = doc.rfind(']');
  if (begin == std::string_view::npos || end == std::string_view::npos || end < begin) return "-";
  return doc.substr(begin + 1, end - begin - 1);
}

/// Walks over every number of a cell.
class Walk {
 public:
  explicit Walk(DiagnosticCollector& diagnostics) : diagnostics_(diagnostics) {}

  template <HasFields T>
  void fields(const T& value, const std::string& path) {
    T::each_field(value, [&](const char* name, const auto& member, const char* doc) {
      visit(member, io::Reader::join(path, std::string(io::file_key<T>(name))), unit_of(doc));
    });
  }

 private:
  void visit(double value, const std::string& path, std::string_view unit) {
    // A joint without a stop has no limit; the physics of limits says which may be infinite.
    if (std::isinf(value) && path.starts_with("robot.limits.")) return;
    const double most = greatest(unit);
    if (std::abs(value) <= most) return;
    diagnostics_.add(
        path, (std::isfinite(value) ? "a magnitude of at most " + text_of(most) : std::string("a finite number")) +
                  (unit == "-" ? "" : " [" + std::string(unit) + "]"));
  }
  void visit(int value, const std::string& path, std::string_view unit) {
    visit(static_cast<double>(value), path, unit);
  }
  void visit(const Pose& T, const std::string& path, std::string_view) {
    for (int i = 0; i < 3; ++i) visit(T.translation()[i], item(path, i), "m");
    if (!T.linear().allFinite()) diagnostics_.add(path, "a finite rotation", "numbers that are not finite");
  }
  template <int R, int C>
  void visit(const Eigen::Matrix<double, R, C>& value, const std::string& path, std::string_view unit) {
    for (Eigen::Index i = 0; i < value.rows(); ++i)
      for (Eigen::Index j = 0; j < value.cols(); ++j)
        visit(value(i, j), C == 1 ? item(path, i) : item(item(path, i), j), unit);
  }
  template <class T>
  void visit(const std::optional<T>& value, const std::string& path, std::string_view unit) {
    if (value) visit(*value, path, unit);
  }
  template <class T>
  void visit(const std::vector<T>& value, const std::string& path, std::string_view unit) {
    const bool one_for_all = path == "servo.joint" && value.size() == 1;  // written without a list
    for (std::size_t i = 0; i < value.size(); ++i)
      visit(value[i], one_for_all ? path : item(path, static_cast<Eigen::Index>(i)), unit);
  }
  template <HasFields T>
  void visit(const T& value, const std::string& path, std::string_view) {
    fields(value, path);
  }
  template <class T>
  requires(!HasFields<T>) void visit(const T&, const std::string&, std::string_view) {}  // texts, names, effects

  DiagnosticCollector& diagnostics_;
};

}  // namespace

void check_magnitude(const Cell& cell, DiagnosticCollector& diagnostics) { Walk(diagnostics).fields(cell, ""); }

}  // namespace kr5::cell
