// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <kr5/core/fields.hpp>
#include <kr5/io/diagnostic.hpp>
#include <kr5/io/node.hpp>

namespace kr5::io {

class Reader;

/// A struct with its own forms in a file, beside a map of its fields.
template <class T>
concept CustomSerializable = requires(T& value, const T& constant, Reader& reader, const Node& node) {
  { value.from_node(reader, node, std::string()) } -> std::same_as<bool>;
  { constant.to_node() } -> std::same_as<Node>;
};

/// A struct whose keys in a file differ from its fields' names: `file_keys` is an array of {field, key}.
template <class T>
concept HasFileKeys = requires {
  T::file_keys.size();
};

/// Key of a field in a file.
template <class T>
constexpr std::string_view file_key(std::string_view field) {
  if constexpr (HasFileKeys<T>)
    for (const auto& [name, key] : T::file_keys)
      if (name == field) return key;
  return field;
}

/// A struct that names, in `static constexpr std::array<std::string_view, n> required`, the keys a file must have.
template <class T>
concept HasRequired = requires {
  T::required.size();
};

/// Reads values out of nodes and collects what is wrong.
class Reader {
 public:
  explicit Reader(std::string file) : file_(std::move(file)) {}

  void report(const Node& node, const std::string& field, const std::string& expected);
  /// The key `field` is not in `map`.
  void report_missing(const Node& map, const std::string& field,
                      const std::string& expected = "this key, it is required");
  static std::string join(const std::string& field, const std::string& name);
  const std::vector<Diagnostic>& diagnostics() const { return diagnostics_; }
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
    if constexpr (HasOldNames<E>)
      for (const auto& [candidate, name] : old_names(value))
        if (node.kind == Node::Kind::Scalar && node.scalar == name) return value = candidate, true;
    return report(node, field, "one of " + choices), false;
  }

  template <class T>
  bool read(const Node& node, const std::string& field, std::optional<T>& value) {
    if (node.kind == Node::Kind::Null) return value.reset(), true;
    return read(node, field, value.emplace());
  }

  template <class T>
  bool read(const Node& node, const std::string& field, std::vector<T>& value) {
    if (node.kind != Node::Kind::Sequence) return report(node, field, "a list"), false;
    value.assign(node.items.size(), T{});
    bool good = true;
    for (std::size_t i = 0; i < value.size(); ++i)
      good &= read(node.items[i], field + "[" + std::to_string(i) + "]", value[i]);
    return good;
  }

  template <class T>
  bool read(const Node& node, const std::string& field, std::map<std::string, T>& value) {
    if (node.kind != Node::Kind::Map) return report(node, field, "a map of name: value"), false;
    bool good = true;
    for (const auto& [key, entry] : node.entries) good &= read(entry, join(field, key), value[key]);
    return good;
  }

  /// Vectors are lists; matrices are lists of rows.
  template <int R, int C>
  bool read(const Node& node, const std::string& field, Eigen::Matrix<double, R, C>& value) {
    return read_matrix(node, field, value);
  }
  /// A pose is six numbers `x y z roll pitch yaw` [m, rad] or a 4x4 matrix.
  bool read(const Node& node, const std::string& field, Eigen::Isometry3d& value);

  template <CustomSerializable T>
  bool read(const Node& node, const std::string& field, T& value) {
    return value.from_node(*this, node, field);
  }
  template <HasFields T>
  requires(!CustomSerializable<T>) bool read(const Node& node, const std::string& field, T& value) {
    return read_fields(node, field, value);
  }
  /// A map of fields. Absent keys keep their defaults, unless the struct requires them.
  template <HasFields T>
  bool read_fields(const Node& node, const std::string& field, T& value) {
    if (node.kind != Node::Kind::Map) return report(node, field, "a map of name: value"), false;
    const std::size_t before = diagnostics_.size();
    std::vector<std::string> known;
    T::each_field(value, [&](const char* name, auto& member, const char*) {
      const std::string& key = known.emplace_back(file_key<T>(name));
      if (const Node* entry = node.find(key)) read(*entry, join(field, key), member);
    });
    if constexpr (HasRequired<T>)
      for (const std::string_view name : T::required)
        if (!node.find(name)) report_missing(node, join(field, std::string(name)));
    report_unknown(node, field, known);
    return diagnostics_.size() == before;
  }

  /// Reports every key that is not in `known`, with the nearest known one.
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
      return report(node, field, size_text(R, C)), false;
    value = any;
    return true;
  }
  void not_a_rotation(const std::string& field, const Node& node, const Eigen::Matrix3d& R);
  static std::string size_text(int rows, int cols);

  std::string file_;
  std::vector<Diagnostic> diagnostics_;
};

}  // namespace kr5::io
