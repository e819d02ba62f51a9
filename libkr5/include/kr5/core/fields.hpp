// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <concepts>
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
/// An enumeration lists its values in a function found beside it:
/// @code
/// constexpr auto enum_names(Mount) { return names<Mount>({{Mount::EyeInHand, "eye_in_hand"}, ...}); }
/// @endcode

namespace kr5 {

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
