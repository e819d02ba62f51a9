// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "field_table.hpp"
#include "pose_caster.hpp"

#include <kr5/core/fields.hpp>
#include <kr5/io/reader.hpp>

/// @file
/// Values of fields to and from Python, with complaints that name the field.

namespace kr5::python {

namespace py = pybind11;

/// Name of a bound type with its module, as in stubs.
template <class T>
std::string class_text() {
  const py::handle type = py::detail::get_type_handle(typeid(T), true);
  return type.attr("__module__").cast<std::string>() + "." + type.attr("__qualname__").cast<std::string>();
}

[[noreturn]] inline void complain(const std::string& where, const std::string& expected, const py::handle& found) {
  throw py::type_error(where + ": expected " + expected + ", found " + py::repr(found).cast<std::string>());
}

/// How one type of field goes to and from Python:
///   text(): as a stub shows it; argument(): the same with what is accepted besides;
///   to_plain(): numbers, texts, lists and dicts only; from_python(): from a Python value or a plain one.
template <class T>
struct Convert;

template <class T>
T cast_or_complain(const py::handle& value, const std::string& where) {
  try {
    return value.cast<T>();
  } catch (const py::cast_error&) {
    complain(where, Convert<T>::text(), value);
  }
}

/// Numbers and texts.
template <class T>
requires(std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) struct Convert<T> {
  static std::string text() {
    if constexpr (std::is_same_v<T, bool>)
      return "bool";
    else if constexpr (std::is_integral_v<T>)
      return "int";
    else if constexpr (std::is_floating_point_v<T>)
      return "float";
    else
      return "str";
  }
  static std::string argument() { return text(); }
  static py::object to_plain(const T& value) { return py::cast(value); }
  static T from_python(const py::handle& value, const std::string& where) { return cast_or_complain<T>(value, where); }
};

template <HasNames E>
struct Convert<E> {
  static std::string text() { return class_text<E>(); }
  static std::string argument() { return text() + " | str"; }
  static py::object to_plain(E value) { return py::str(std::string(name_of(value))); }
  static E from_python(const py::handle& value, const std::string& where) {
    if (!py::isinstance<py::str>(value)) return cast_or_complain<E>(value, where);
    const auto wanted = value.cast<std::string>();
    std::string all;
    for (const auto& [candidate, name] : enum_names(E{})) {
      if (name == wanted) return candidate;
      all += (all.empty() ? "" : " | ") + std::string(name);
    }
    throw py::value_error(where + ": found '" + wanted + "', expected one of " + all);
  }
};

template <class T>
struct Convert<std::optional<T>> {
  static std::string text() { return Convert<T>::text() + " | None"; }
  static std::string argument() { return Convert<T>::argument() + " | None"; }
  static py::object to_plain(const std::optional<T>& value) {
    return value ? Convert<T>::to_plain(*value) : py::object(py::none());
  }
  static std::optional<T> from_python(const py::handle& value, const std::string& where) {
    if (value.is_none()) return std::nullopt;
    return Convert<T>::from_python(value, where);
  }
};

template <class T>
struct Convert<std::vector<T>> {
  static std::string text() { return "list[" + Convert<T>::text() + "]"; }
  static std::string argument() { return "collections.abc.Sequence[" + Convert<T>::argument() + "]"; }
  static py::object to_plain(const std::vector<T>& value) {
    py::list out;
    for (const T& item : value) out.append(Convert<T>::to_plain(item));
    return out;
  }
  static std::vector<T> from_python(const py::handle& value, const std::string& where) {
    if (!py::isinstance<py::sequence>(value) && !py::isinstance<py::array>(value)) complain(where, text(), value);
    if (py::isinstance<py::str>(value)) complain(where, text(), value);
    std::vector<T> out;
    for (const auto& item : value)
      out.push_back(Convert<T>::from_python(item, where + "[" + std::to_string(out.size()) + "]"));
    return out;
  }
};

template <class T>
struct Convert<std::map<std::string, T>> {
  static std::string text() { return "dict[str, " + Convert<T>::text() + "]"; }
  static std::string argument() { return "dict[str, " + Convert<T>::argument() + "]"; }
  static py::object to_plain(const std::map<std::string, T>& value) {
    py::dict out;
    for (const auto& [key, item] : value) out[py::str(key)] = Convert<T>::to_plain(item);
    return out;
  }
  static std::map<std::string, T> from_python(const py::handle& value, const std::string& where) {
    if (!py::isinstance<py::dict>(value)) complain(where, text(), value);
    std::map<std::string, T> out;
    for (const auto& [key, item] : py::reinterpret_borrow<py::dict>(value)) {
      const auto name = cast_or_complain<std::string>(key, where);
      out[name] = Convert<T>::from_python(item, where + "." + name);
    }
    return out;
  }
};

/// Vectors are lists, matrices lists of rows. Points may stand in rows, too: points_caster.hpp.
template <class S, int R, int C>
struct Convert<Eigen::Matrix<S, R, C>> {
  using Matrix = Eigen::Matrix<S, R, C>;
  static constexpr bool points = (R == 2 || R == 3) && C == Eigen::Dynamic;
  static std::string text() { return "numpy.ndarray"; }
  static std::string argument() { return "numpy.typing.ArrayLike"; }
  static std::string shape() {
    const auto side = [](int n) { return n == Eigen::Dynamic ? std::string("n") : std::to_string(n); };
    if (points) return "(" + side(R) + ", n) or (n, " + side(R) + ")";
    return C == 1 ? "(" + side(R) + ",)" : "(" + side(R) + ", " + side(C) + ")";
  }
  static py::object to_plain(const Matrix& value) { return py::cast(value).attr("tolist")(); }
  static Matrix from_python(const py::handle& value, const std::string& where) {
    try {
      return value.cast<Matrix>();
    } catch (const py::value_error& e) {
      throw py::value_error(where + ": " + e.what());
    } catch (const py::cast_error&) {
      complain(where, "an array of numbers of shape " + shape(), value);
    }
  }
};

template <>
struct Convert<Pose> {
  static std::string text() { return "numpy.ndarray"; }
  static std::string argument() { return "numpy.typing.ArrayLike"; }
  static std::string shape() { return "(4, 4)"; }
  static py::object to_plain(const Pose& value) { return py::cast(value).attr("tolist")(); }
  static Pose from_python(const py::handle& value, const std::string& where) {
    try {
      return value.cast<Pose>();
    } catch (const py::value_error& e) {
      throw py::value_error(where + ": " + e.what());
    } catch (const py::cast_error&) {
      complain(where, "a pose as a 4x4 array", value);
    }
  }
};

template <HasFields T>
const Fields& fields_of();

/// Structs: as an instance, or as a dict of fields.
template <HasFields T>
struct Convert<T> {
  static std::string text() { return class_text<T>(); }
  static std::string argument() { return text() + " | dict[str, typing.Any]"; }
  static py::object to_plain(const T& value) { return python::to_plain(&value, fields_of<T>()); }
  static T from_python(const py::handle& value, const std::string& where) {
    if (!py::isinstance<py::dict>(value)) return cast_or_complain<T>(value, where);
    T out;
    set_fields(&out, fields_of<T>(), py::reinterpret_borrow<py::dict>(value), where);
    return out;
  }
};

template <class T>
py::object get_member(void* value, const py::handle& owner) {
  T& member = *static_cast<T*>(value);
  if constexpr (HasFields<T>) {
    return py::cast(&member, py::return_value_policy::reference_internal, owner);
  } else {
    py::object out = py::cast(static_cast<const T&>(member));
    if (py::isinstance<py::array>(out)) out.attr("setflags")(py::arg("write") = false);
    return out;
  }
}

template <class T>
constexpr auto fields_function() -> const Fields& (*)() {
  if constexpr (HasFields<T>)
    return &fields_of<T>;
  else
    return nullptr;
}

template <class T>
std::vector<std::string> choices() {
  std::vector<std::string> out;
  if constexpr (HasNames<T>)
    for (const auto& [value, name] : enum_names(T{})) out.emplace_back(name);
  return out;
}

template <class T>
std::string shape_of() {
  if constexpr (requires { Convert<T>::shape(); })
    return Convert<T>::shape();
  else
    return {};
}

/// The one entry of a type.
template <class T>
inline constexpr FieldType field_type{
    &Convert<T>::text,
    &Convert<T>::argument,
    &shape_of<T>,
    [](const void* value) { return py::object(Convert<T>::to_plain(*static_cast<const T*>(value))); },
    [](void* value, const py::handle& from, const std::string& where) {
      *static_cast<T*>(value) = Convert<T>::from_python(from, where);
    },
    &get_member<T>,
    &choices<T>,
    fields_function<T>()};

/// Whether a file must have the key.
template <class T>
bool is_required(std::string_view key) {
  if constexpr (io::HasRequired<T>) return std::ranges::find(T::required, key) != T::required.end();
  return false;
}

template <HasFields T>
const Fields& fields_of() {
  static const Fields all = [] {
    Fields out;
    const T value{};
    T::each_field(value, [&](const char* name, const auto& member, const FieldDoc& doc) {
      const auto offset = reinterpret_cast<const char*>(&member) - reinterpret_cast<const char*>(&value);
      const std::string_view key = io::file_key<T>(name);
      out.push_back({name, doc.text, doc.covariance_of, key, is_required<T>(key), offset,
                     &field_type<std::remove_cvref_t<decltype(member)>>});
    });
    return out;
  }();
  return all;
}

}  // namespace kr5::python
