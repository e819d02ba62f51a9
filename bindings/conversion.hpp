// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "pose_caster.hpp"

#include <kr5/core/fields.hpp>

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

/// Sentence for a name that is not among `known`, with the nearest one.
inline std::string unknown_field(const std::string& where, const py::handle& name, const py::list& known) {
  const std::string key = py::str(name).cast<std::string>();
  const py::list near = py::module_::import("difflib").attr("get_close_matches")(key, known, 1, 0.5);
  const std::string hint = near.empty() ? "there are " + py::str(", ").attr("join")(known).cast<std::string>()
                                        : "did you mean '" + near[0].cast<std::string>() + "'?";
  return where + ": no field '" + key + "'; " + hint;
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

/// Vectors are lists, matrices lists of rows.
template <class S, int R, int C>
struct Convert<Eigen::Matrix<S, R, C>> {
  using Matrix = Eigen::Matrix<S, R, C>;
  static std::string text() { return "numpy.ndarray"; }
  static std::string argument() { return "numpy.typing.ArrayLike"; }
  static std::string shape() {
    const auto side = [](int n) { return n == Eigen::Dynamic ? std::string("n") : std::to_string(n); };
    return C == 1 ? "(" + side(R) + ",)" : "(" + side(R) + ", " + side(C) + ")";
  }
  static py::object to_plain(const Matrix& value) { return py::cast(value).attr("tolist")(); }
  static Matrix from_python(const py::handle& value, const std::string& where) {
    try {
      return value.cast<Matrix>();
    } catch (const py::cast_error&) {
      complain(where, "an array of numbers of shape " + shape(), value);
    }
  }
};

template <>
struct Convert<Pose> {
  static std::string text() { return "numpy.ndarray"; }
  static std::string argument() { return "numpy.typing.ArrayLike"; }
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
T struct_from_python(const py::handle& value, const std::string& where);  // struct_binder.hpp

template <HasFields T>
struct Convert<T> {
  static std::string text() { return class_text<T>(); }
  static std::string argument() { return text() + " | dict[str, typing.Any]"; }
  static py::object to_plain(const T& value) {
    py::dict out;
    T::each_field(value, [&](const char* name, const auto& member, const char*) {
      out[name] = Convert<std::remove_cvref_t<decltype(member)>>::to_plain(member);
    });
    return out;
  }
  static T from_python(const py::handle& value, const std::string& where) {
    return struct_from_python<T>(value, where);
  }
};

/// What a property hands out: a copy, and an array that cannot be written, lest somebody believe it changes the struct.
template <class T>
py::object frozen(const T& value) {
  py::object out = py::cast(value);
  if (py::isinstance<py::array>(out)) out.attr("setflags")(py::arg("write") = false);
  return out;
}

/// Names a field of an enumeration may have; empty for other types.
template <class T>
std::vector<std::string> choices() {
  std::vector<std::string> out;
  if constexpr (HasNames<T>)
    for (const auto& [value, name] : enum_names(T{})) out.emplace_back(name);
  return out;
}

/// `repr` of a field: long lists and arrays by their size alone.
template <class T>
std::string short_text(const T& value) {
  constexpr py::ssize_t longest = 120;
  if constexpr (HasFields<T>) {
    std::string out;
    T::each_field(value, [&](const char* name, const auto& member, const char*) {
      out += (out.empty() ? "(" : ", ") + std::string(name) + "=" + short_text(member);
    });
    return out + ")";
  } else {
    const py::object plain = Convert<T>::to_plain(value);
    std::string text = py::repr(plain).cast<std::string>();
    if (py::isinstance<py::str>(plain) || static_cast<py::ssize_t>(text.size()) <= longest) return text;
    const py::object whole = py::cast(value);
    if (py::isinstance<py::array>(whole))
      return "<array of shape " + py::str(whole.attr("shape")).cast<std::string>() + ">";
    return "<" + Convert<T>::text() + " of " + std::to_string(py::len(plain)) + ">";
  }
}

}  // namespace kr5::python
