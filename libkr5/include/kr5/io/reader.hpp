// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <kr5/core/fields.hpp>
#include <kr5/io/node.hpp>
#include <kr5/io/problem.hpp>

namespace kr5::io {

class Reader;

/// A struct that a file may write in more ways than a map of its fields.
template <class T>
concept HasForms = requires(T& value, const T& constant, Reader& reader, const Node& node) {
  { value.read_form(reader, node, std::string()) } -> std::same_as<bool>;
  { constant.write_form() } -> std::same_as<Node>;
};

/// A struct that names, in `static constexpr std::array<std::string_view, n> required`, the keys a file must have.
template <class T>
concept HasRequired = requires {
  T::required.size();
};

/// Reads values out of nodes and collects what is wrong.
class Reader {
 public:
  explicit Reader(std::string file) : file_(std::move(file)) {}

  void problem(const Node& node, const std::string& field, const std::string& expected);
  /// The key `field` is not in `map`.
  void missing(const Node& map, const std::string& field, const std::string& expected = "this key, it is required");
  static std::string join(const std::string& field, const std::string& name);
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

  template <HasForms T>
  bool read(const Node& node, const std::string& field, T& value) {
    return value.read_form(*this, node, field);
  }
  template <HasFields T>
  requires(!HasForms<T>) bool read(const Node& node, const std::string& field, T& value) {
    return read_fields(node, field, value);
  }
  /// A map of fields. Absent keys keep their defaults, unless the struct requires them.
  template <HasFields T>
  bool read_fields(const Node& node, const std::string& field, T& value) {
    if (node.kind != Node::Kind::Map) return problem(node, field, "a map of name: value"), false;
    const std::size_t before = problems_.size();
    std::vector<std::string> known;
    T::each_field(value, [&](const char* name, auto& member, const char*) {
      known.push_back(name);
      if (const Node* entry = node.find(name)) read(*entry, join(field, name), member);
    });
    if constexpr (HasRequired<T>)
      for (const std::string_view name : T::required)
        if (!node.find(name)) missing(node, join(field, std::string(name)));
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
  void not_a_rotation(const std::string& field, const Node& node, const Eigen::Matrix3d& R);
  static std::string size_text(int rows, int cols);

  std::string file_;
  std::vector<Problem> problems_;
};

}  // namespace kr5::io
