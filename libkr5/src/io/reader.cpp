// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/io/reader.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include <kr5/geometry/pose.hpp>

namespace kr5::io {
namespace {

std::string describe(const Node& node) {
  switch (node.kind) {
    case Node::Kind::Null:
      return "nothing";
    case Node::Kind::Scalar:
      return (node.quoted ? "the quoted text '" : "'") + shortened(node.scalar) + "'";
    case Node::Kind::Sequence:
      return "a list of " + std::to_string(node.items.size());
    case Node::Kind::Map:
      return "a map of " + std::to_string(node.entries.size());
  }
  return "?";
}

bool parse_number(std::string_view text, double& value) {
  if (text == ".inf" || text == "+.inf") return value = std::numeric_limits<double>::infinity(), true;
  if (text == "-.inf") return value = -std::numeric_limits<double>::infinity(), true;
  if (text == ".nan") return value = std::numeric_limits<double>::quiet_NaN(), true;
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  // from_chars takes "nan" and "inf" too; in YAML these are words.
  return !text.empty() && error == std::errc{} && end == text.data() + text.size() && std::isfinite(value);
}

}  // namespace

void Reader::report(const Node& node, const std::string& field, const std::string& expected) {
  diagnostics_.push_back({file_, node.line, field, describe(node), expected});
}

void Reader::report_missing(const Node& map, const std::string& field, const std::string& expected) {
  diagnostics_.push_back({file_, map.line, field, "nothing", expected});
}

std::string Reader::join(const std::string& field, const std::string& name) {
  return field.empty() ? name : field + "." + name;
}

void Reader::finish() const { throw_diagnostics(diagnostics_); }

bool Reader::read(const Node& node, const std::string& field, double& value) {
  if (node.kind == Node::Kind::Scalar && !node.quoted && parse_number(node.scalar, value)) {
    if (!std::isnan(value)) return true;
    return report(node, field, "a number, not NaN"), false;
  }
  return report(node, field, "a number"), false;
}

bool Reader::read(const Node& node, const std::string& field, int& value) {
  const char* begin = node.scalar.data();
  const char* end = begin + node.scalar.size();
  if (node.kind == Node::Kind::Scalar && !node.quoted && !node.scalar.empty()) {
    const auto [stop, error] = std::from_chars(begin, end, value);
    if (error == std::errc{} && stop == end) return true;
  }
  return report(node, field, "a whole number"), false;
}

bool Reader::read(const Node& node, const std::string& field, bool& value) {
  if (node.kind == Node::Kind::Scalar && !node.quoted && (node.scalar == "true" || node.scalar == "false"))
    return value = node.scalar == "true", true;
  return report(node, field, "true or false"), false;
}

bool Reader::read(const Node& node, const std::string& field, std::string& value) {
  if (node.kind == Node::Kind::Scalar) return value = node.scalar, true;
  return report(node, field, "text"), false;
}

bool Reader::read(const Node& node, const std::string& field, Eigen::Isometry3d& value) {
  const auto wanted = "a pose: six numbers x y z roll pitch yaw [m, rad], or a 4x4 matrix";
  if (node.kind != Node::Kind::Sequence) return report(node, field, wanted), false;
  if (node.items.size() == 6) {
    Vector6 v;
    if (!read(node, field, v)) return false;
    constexpr double most_angle = 1e4;  // [rad]; of a larger one the digits say nothing
    if (!(v.tail<3>().cwiseAbs().maxCoeff() <= most_angle))
      return report(node, field, "a pose x y z roll pitch yaw [m, rad] with angles of at most 1e4 rad"), false;
    value = from_xyzrpy(v);
    return true;
  }
  if (node.items.size() != 4) return report(node, field, wanted), false;
  Eigen::MatrixXd m;
  if (!read_matrix(node, field, m)) return false;
  if (m.cols() != 4 || m.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    return report(node, field, "a 4x4 pose with the last row 0 0 0 1"), false;
  if (!is_rotation(m.topLeftCorner<3, 3>())) return not_a_rotation(field, node, m.topLeftCorner<3, 3>()), false;
  value.matrix() = m;
  return true;
}

void Reader::not_a_rotation(const std::string& field, const Node& node, const Eigen::Matrix3d& R) {
  const bool mirrored = is_rotation(-R);
  diagnostics_.push_back({file_, node.line, field,
                          mirrored ? "a mirrored rotation (determinant -1)" : "a matrix that is not a rotation",
                          mirrored ? "a proper rotation; is an axis negated, or the frame left-handed?"
                                   : "orthonormal columns in the upper left 3x3 part"});
}

bool Reader::read_matrix(const Node& node, const std::string& field, Eigen::MatrixXd& value) {
  std::vector<std::vector<double>> rows;
  if (!read(node, field, rows)) return false;
  const std::size_t cols = rows.empty() ? 0 : rows[0].size();
  value.resize(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(cols));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].size() != cols) return report(node, field, "rows of equal length"), false;
    for (std::size_t j = 0; j < cols; ++j)
      value(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = rows[i][j];
  }
  return true;
}

std::string Reader::size_text(int rows, int cols) {
  const auto side = [](int n) { return n == Eigen::Dynamic ? std::string("n") : std::to_string(n); };
  return cols == 1 ? "a list of " + side(rows) + " numbers" : "a " + side(rows) + " x " + side(cols) + " matrix";
}

void Reader::report_unknown(const Node& node, const std::string& field, const std::vector<std::string>& known) {
  for (const auto& [key, entry] : node.entries) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    const std::string near = nearest_name(key, known);
    std::string expected = "one of";
    for (const std::string& name : known) expected += " " + name;
    if (!near.empty()) expected = "no such key; did you mean '" + near + "'?";
    diagnostics_.push_back({file_, entry.line, join(field, key), "an unknown key", expected});
  }
}

}  // namespace kr5::io
