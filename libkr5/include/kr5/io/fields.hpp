// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <kr5/core/error.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/io/node.hpp>

/// @file
/// Any struct with a field list to and from a Node. Unknown keys and wrong types are collected as problems with
/// line, field, the value found and what was expected, all in one pass.

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

/// Reads values out of nodes and collects what is wrong.
class Reader {
 public:
  explicit Reader(std::string file) : file_(std::move(file)) {}

  void problem(const Node& node, const std::string& field, const std::string& expected);
  const std::vector<Problem>& problems() const { return problems_; }
  const std::string& file() const { return file_; }
  /// @throws IoError with every problem, one a line, when there is any.
  void finish() const;

  bool read(const Node& node, const std::string& field, double& value);
  bool read(const Node& node, const std::string& field, int& value);
  bool read(const Node& node, const std::string& field, bool& value);
  bool read(const Node& node, const std::string& field, std::string& value);

  template <HasNames E>
  bool read(const Node& node, const std::string& field, E& value) {
    std::string choices;
    for (const auto& [candidate, name] : enum_names(value)) {
      if (node.kind == Node::Kind::Scalar && node.scalar == name) return value = candidate, true;
      choices += (choices.empty() ? "" : " | ") + std::string(name);
    }
    return problem(node, field, "one of " + choices), false;
  }

  template <class T>
  bool read(const Node& node, const std::string& field, std::optional<T>& value) {
    if (node.kind == Node::Kind::Null) return value.reset(), true;
    return read(node, field, value.emplace());
  }

  template <class T>
  bool read(const Node& node, const std::string& field, std::vector<T>& value) {
    if (node.kind != Node::Kind::Sequence) return problem(node, field, "a list"), false;
    value.assign(node.items.size(), T{});
    bool good = true;
    for (std::size_t i = 0; i < value.size(); ++i)
      good &= read(node.items[i], field + "[" + std::to_string(i) + "]", value[i]);
    return good;
  }

  template <class T>
  bool read(const Node& node, const std::string& field, std::map<std::string, T>& value) {
    if (node.kind != Node::Kind::Map) return problem(node, field, "a map of name: value"), false;
    bool good = true;
    for (const auto& [key, entry] : node.entries) good &= read(entry, field.empty() ? key : field + "." + key, value[key]);
    return good;
  }

  /// Vectors are lists; matrices are lists of rows.
  template <int R, int C>
  bool read(const Node& node, const std::string& field, Eigen::Matrix<double, R, C>& value) {
    return read_matrix(node, field, value);
  }
  /// A pose is six numbers `x y z roll pitch yaw` [m, rad] or a 4x4 matrix.
  bool read(const Node& node, const std::string& field, Eigen::Isometry3d& value);

  template <HasFields T>
  bool read(const Node& node, const std::string& field, T& value) {
    if (node.kind != Node::Kind::Map) return problem(node, field, "a map of name: value"), false;
    const std::size_t before = problems_.size();
    std::vector<std::string> known;
    T::each_field(value, [&](const char* name, auto& member, const char*) {
      known.push_back(name);
      if (const Node* entry = node.find(name)) read(*entry, field.empty() ? name : field + "." + name, member);
    });
    report_unknown(node, field, known);
    return problems_.size() == before;
  }

  /// Complains about every key that is not in `known`, and names the nearest one.
  void report_unknown(const Node& node, const std::string& field, const std::vector<std::string>& known);

 private:
  bool read_matrix(const Node& node, const std::string& field, Eigen::MatrixXd& value);

  template <int R, int C>
  bool read_matrix(const Node& node, const std::string& field, Eigen::Matrix<double, R, C>& value) {
    Eigen::MatrixXd any;
    if (C == 1) {
      std::vector<double> list;
      if (!read(node, field, list)) return false;
      any = Eigen::Map<Eigen::VectorXd>(list.data(), static_cast<Eigen::Index>(list.size()));
    } else if (!read_matrix(node, field, any)) {
      return false;
    }
    if ((R != Eigen::Dynamic && any.rows() != R) || (C != Eigen::Dynamic && any.cols() != C))
      return problem(node, field, size_text(R, C)), false;
    value = any;
    return true;
  }
  static std::string size_text(int rows, int cols);

  std::string file_;
  std::vector<Problem> problems_;
};

Node to_node(double value);
Node to_node(int value);
Node to_node(bool value);
Node to_node(const std::string& value);
Node to_node(const Eigen::Isometry3d& T);  ///< As a 4x4 matrix, so that nothing is lost.

template <HasNames E>
Node to_node(E value) {
  return Node::of(std::string(name_of(value)));
}
template <int R, int C>
Node to_node(const Eigen::Matrix<double, R, C>& value);
template <class T>
Node to_node(const std::vector<T>& value);
template <class T>
Node to_node(const std::map<std::string, T>& value);
template <HasFields T>
Node to_node(const T& value);

template <class T>
Node to_node(const std::optional<T>& value) {
  return value ? to_node(*value) : Node{};
}

template <int R, int C>
Node to_node(const Eigen::Matrix<double, R, C>& value) {
  Node node;
  node.kind = Node::Kind::Sequence;
  node.flow = true;
  for (Eigen::Index i = 0; i < value.rows(); ++i) {
    if constexpr (C == 1) {
      node.items.push_back(to_node(value(i)));
    } else {
      node.flow = false;
      node.items.push_back(to_node(Eigen::VectorXd(value.row(i))));
    }
  }
  return node;
}

template <class T>
Node to_node(const std::vector<T>& value) {
  Node node;
  node.kind = Node::Kind::Sequence;
  node.flow = !HasFields<T>;
  for (const auto& item : value) node.items.push_back(to_node(static_cast<const T&>(item)));
  return node;
}

template <class T>
Node to_node(const std::map<std::string, T>& value) {
  Node node;
  node.kind = Node::Kind::Map;
  for (const auto& [key, item] : value) node.entries.emplace_back(key, to_node(item));
  return node;
}

template <HasFields T>
Node to_node(const T& value) {
  Node node;
  node.kind = Node::Kind::Map;
  T::each_field(value, [&](const char* name, const auto& member, const char*) {
    node.entries.emplace_back(name, to_node(member));
  });
  return node;
}

/// Reads a struct from a YAML file; fields that are absent keep their defaults.
/// @throws IoError listing every problem with file, line, field, value found and what was expected.
template <HasFields T>
T load(const std::filesystem::path& file) {
  T value;
  Reader reader(file.string());
  reader.read(load_yaml(file), "", value);
  reader.finish();
  if constexpr (HasValidate<T>) value.validate();
  return value;
}

/// Writes a struct as YAML.
template <HasFields T>
void save(const T& value, const std::filesystem::path& file) {
  write_text(file, to_yaml(to_node(value)));
}

}  // namespace kr5::io
