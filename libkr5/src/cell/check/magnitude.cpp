// SPDX-License-Identifier: BSD-3-Clause
#include "cell/check/magnitude.hpp"

#include <cmath>
#include <map>
#include <string_view>
#include <type_traits>

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

/// The least of these: no unit need be known below it.
constexpr double min_limit = 1e2;

/// A field on the way from the cell to a number. Texts are made where a number is wrong: a simulator checks a cell
/// before each prediction.
struct Step {
  const Step* outer = nullptr;
  const char* name = nullptr;  ///< Of a field; null for an element of a list.
  std::string_view (*key)(std::string_view) = nullptr;
  Eigen::Index index = -1;
  const char* doc = "";

  std::string path() const {
    const std::string before = outer ? outer->path() : "";
    if (name) return io::Reader::join(before, std::string(key(name)));
    return index < 0 ? before : item(before, index);
  }
};

/// Walks over every number of a cell.
class Walk {
 public:
  explicit Walk(DiagnosticCollector& diagnostics) : diagnostics_(diagnostics) {}

  template <HasFields T>
  void fields(const T& value, const Step* at) {
    T::each_field(value, [&](const char* name, const auto& member, const char* doc) {
      visit(member, {at, name, &io::file_key<T>, -1, doc});
    });
  }

 private:
  void visit(double value, const Step& at) {
    if (std::abs(value) <= min_limit) return;
    check(value, at, unit_of(at.doc));
  }
  void visit(int value, const Step& at) { visit(static_cast<double>(value), at); }
  void visit(const Pose& T, const Step& at) {
    for (int i = 0; i < 3; ++i)
      if (!(std::abs(T.translation()[i]) <= min_limit)) check(T.translation()[i], element(at, i), "m");
    if (!T.linear().allFinite()) diagnostics_.add(at.path(), "a finite rotation", "numbers that are not finite");
  }
  template <int R, int C>
  void visit(const Eigen::Matrix<double, R, C>& value, const Step& at) {
    for (Eigen::Index i = 0; i < value.rows(); ++i) {
      const Step row = element(at, i);
      for (Eigen::Index j = 0; j < value.cols(); ++j) visit(value(i, j), C == 1 ? row : element(row, j));
    }
  }
  template <class T>
  void visit(const std::optional<T>& value, const Step& at) {
    if (value) visit(*value, at);
  }
  template <class T>
  void visit(const std::vector<T>& value, const Step& at) {
    const bool one_for_all = std::is_same_v<T, SecondOrder> && value.size() == 1;  // written without a list
    for (std::size_t i = 0; i < value.size(); ++i)
      visit(value[i], element(at, one_for_all ? -1 : static_cast<Eigen::Index>(i)));
  }
  template <HasFields T>
  void visit(const T& value, const Step& at) {
    fields(value, &at);
  }
  template <class T>
  requires(!HasFields<T>) void visit(const T&, const Step&) {}  // texts, names, effects

  static Step element(const Step& list, Eigen::Index index) { return {&list, nullptr, nullptr, index, list.doc}; }

  void check(double value, const Step& at, std::string_view unit) {
    const double most = greatest(unit);
    if (std::abs(value) <= most) return;
    const std::string path = at.path();
    // A joint without a stop has no limit; the physics of limits says which may be infinite.
    if (std::isinf(value) && path.starts_with("robot.limits.")) return;
    diagnostics_.add(
        path, (std::isfinite(value) ? "a magnitude of at most " + text_of(most) : std::string("a finite number")) +
                  (unit == "-" ? "" : " [" + std::string(unit) + "]"));
  }

  DiagnosticCollector& diagnostics_;
};

}  // namespace

void check_magnitude(const Cell& cell, DiagnosticCollector& diagnostics) { Walk(diagnostics).fields(cell, nullptr); }

}  // namespace kr5::cell
