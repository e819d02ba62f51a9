// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <concepts>
#include <string>
#include <string_view>
#include <utility>

/// @file
/// One list of fields per struct. Python keywords, repr, dict, YAML and `--help` are all made from it.
///
/// A struct lists its fields in a static member:
/// @code
/// struct Options {
///   double sigma = 1e-3;  ///< [m]
///   static void each_field(auto& self, auto&& visit) { visit("sigma", self.sigma, "Standard deviation [m]."); }
/// };
/// @endcode
/// What is said of a field of a number ends with its unit in brackets, `[-]` for a plain number; `unit_of` tells it. A
/// covariance names the fields that it is of:
/// @code
/// visit("covariance", self.covariance, covariance_doc("T_base_tool", "Covariance of T_base_tool [m, rad]."));
/// @endcode
/// An enumeration lists its values in a function found beside it:
/// @code
/// constexpr auto enum_names(Mount) { return names<Mount>({{Mount::EyeInHand, "eye_in_hand"}, ...}); }
/// @endcode
/// Names that stand in files of earlier versions are in `old_names`, a function of the same form, and are read, too.

namespace kr5 {

/// What is said of a field. A literal will do, and stands for one.
struct FieldDoc {
  constexpr FieldDoc(const char* text, const char* covariance_of = "") : text(text), covariance_of(covariance_of) {}
  constexpr operator const char*() const { return text; }

  const char* text;
  const char* covariance_of;  ///< Fields with blanks between, "T_base_tool" or "camera.fx camera.fy"; else empty.
};

/// Of a field that is the covariance of others of the struct: of a pose (right perturbation), of an array, or of as
/// many numbers as it has rows.
constexpr FieldDoc covariance_doc(const char* fields, const char* text) { return {text, fields}; }

/// The unit in what is said of a field: what stands in the last brackets; `-` without.
constexpr std::string_view unit_of(std::string_view doc) {
  const std::size_t begin = doc.rfind('['), end = doc.rfind(']');
  if (begin == std::string_view::npos || end == std::string_view::npos || end < begin) return "-";
  return doc.substr(begin + 1, end - begin - 1);
}

/// The rest of it, without what stands in brackets.
inline std::string without_unit(std::string_view doc) {
  std::string out;
  for (std::size_t at = 0; at < doc.size();) {
    const std::size_t begin = doc.find('[', at), end = doc.find(']', begin);
    if (end == std::string_view::npos) return out.append(doc.substr(at));
    out.append(doc.substr(at, begin - at));
    while (!out.empty() && out.back() == ' ') out.pop_back();
    at = end + 1;
  }
  return out;
}

namespace detail {
struct AnyVisitor {
  void operator()(const char*, auto&, const char*) const {}
};
}  // namespace detail

/// A struct with a field list.
template <class T>
concept HasFields = requires(T& value) {
  T::each_field(value, detail::AnyVisitor{});
};

/// An enumeration with a list of names.
template <class T>
concept HasNames = std::is_enum_v<T> && requires(T value) {
  enum_names(value);
};

/// One with names of earlier versions.
template <class T>
concept HasOldNames = HasNames<T> && requires(T value) {
  old_names(value);
};

/// Options that can validate themselves.
template <class T>
concept HasValidate = requires(const T& value) {
  value.validate();
};

/// The table `enum_names` returns.
template <class E, std::size_t N>
constexpr std::array<std::pair<E, std::string_view>, N> names(const std::pair<E, std::string_view> (&table)[N]) {
  std::array<std::pair<E, std::string_view>, N> out{};
  for (std::size_t i = 0; i < N; ++i) out[i] = table[i];
  return out;
}

/// Name of an enumerator.
template <HasNames E>
constexpr std::string_view name_of(E value) {
  for (const auto& [candidate, name] : enum_names(value))
    if (candidate == value) return name;
  return "?";
}

}  // namespace kr5
