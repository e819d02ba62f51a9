// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cctype>
#include <memory>
#include <string>

#include "conversion.hpp"

/// @file
/// Python classes made from field lists: what `each_field` and `enum_names` say is all there is to write.
/// @code
/// bind_enum<Mount>(m, "Mount", "What carries the camera.");
/// bind_struct<HandEyeOptions>(m, "HandEyeOptions", "Options of calibrate_hand_eye.");
/// @endcode
/// Bind what a struct holds before the struct. Extra members are added to the class that bind_struct returns.

namespace kr5::python {

/// An enumeration whose values have their C++ names, and which is accepted by its string name everywhere.
template <HasNames E>
py::enum_<E> bind_enum(py::module_& m, const char* name, const char* doc) {
  py::enum_<E> cls(m, name, doc);
  for (const auto& [value, text] : enum_names(E{})) {
    std::string pascal;
    bool upper = true;  // "eye_in_hand" is EyeInHand
    for (const char c : text) {
      if (c == '_') {
        upper = true;
      } else {
        pascal += upper ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
        upper = false;
      }
    }
    if (pascal == "None") pascal += '_';  // a keyword of Python
    cls.value(pascal.c_str(), value);
  }
  cls.def(py::init([name = std::string(name)](const std::string& text) {
            return Convert<E>::from_python(py::str(text), name);
          }),
          py::arg("name"));
  cls.def(
      "__str__", [](E value) { return std::string(name_of(value)); }, "Name as in files and on the command line.");
  py::implicitly_convertible<py::str, E>();
  return cls;
}

/// Keyword constructor, properties, repr, to_dict, from_dict, fields, pickling, and validate when there is one.
/// What a property gives is a copy (arrays are read-only), except a struct inside a struct: assign the whole field.
/// `Base`: a struct bound before, from which T inherits.
template <HasFields T, class... Base>
py::class_<T, Base...> bind_struct(py::module_& m, const char* name, const char* doc) {
  const Fields& fields = fields_of<T>();
  const auto [signature, list] = document(m.attr("__name__").cast<std::string>() + "." + name, fields);
  py::class_<T, Base...> cls(m, name, (doc + list).c_str());
  {
    py::options options;
    options.disable_function_signatures();  // ours tell more
    cls.def(py::init([own = std::string(name)](const py::kwargs& kwargs) {
              auto value = std::make_unique<T>();
              set_fields(value.get(), fields_of<T>(), kwargs, own);
              return value;
            }),
            signature.c_str());
  }
  add_members(cls, fields, [](const py::handle& self) -> void* { return &self.cast<T&>(); });
  if constexpr (HasValidate<T>)
    cls.def(
        "validate", [](const T& self) { self.validate(); }, "Raises InvalidArgument naming the offending field.");
  return cls;
}

}  // namespace kr5::python
