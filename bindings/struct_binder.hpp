// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cctype>
#include <string>
#include <type_traits>
#include <utility>

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

/// Member number `index` of a struct, which is of type M.
template <class M, class T>
auto& field_at(T& value, std::size_t index) {
  using Member = std::conditional_t<std::is_const_v<T>, const M, M>;
  Member* found = nullptr;
  T::each_field(value, [&](const char*, auto& member, const char*) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(member)>, M>)
      if (index == 0) found = &member;
    --index;
  });
  return *found;
}

/// Sets the members that `dict` names. Fields that are absent keep their values.
/// @throws TypeError for an unknown name, or a value of the wrong type.
template <HasFields T>
void set_fields(T& value, const py::dict& dict, const std::string& where) {
  py::list known;
  T::each_field(value, [&](const char* name, auto& member, const char*) {
    known.append(name);
    if (dict.contains(name))
      member = Convert<std::remove_cvref_t<decltype(member)>>::from_python(dict[name], where + "." + name);
  });
  for (const auto& [key, item] : dict)
    if (!known.contains(key)) throw py::type_error(unknown_field(where, key, known));
}

/// `fields()`: what the command line makes its options from.
template <HasFields T>
py::list describe_fields() {
  py::list out;
  const T defaults{};
  T::each_field(defaults, [&](const char* name, const auto& member, const char* doc) {
    using Member = std::remove_cvref_t<decltype(member)>;
    py::dict field;
    field["name"] = name;
    field["type"] = Convert<Member>::text();
    field["default"] = Convert<Member>::to_plain(member);
    field["doc"] = doc;
    field["choices"] = choices<Member>();
    out.append(field);
  });
  return out;
}

/// Texts for people and for the stubs: the signature of the constructor, and the list of fields.
template <HasFields T>
std::pair<std::string, std::string> document(const std::string& name) {
  std::string signature = "__init__(self: " + name, list;
  const T defaults{};
  bool first = true;
  T::each_field(defaults, [&](const char* field, const auto& member, const char* doc) {
    using Member = std::remove_cvref_t<decltype(member)>;
    signature += std::string(first ? ", *, " : ", ") + field + ": " + Convert<Member>::argument() + " = ...";
    list += std::string("\n") + field + " : " + Convert<Member>::text() + "\n    " + doc;
    first = false;
  });
  return {signature + ") -> None\n\nFields that are not given keep their defaults.", "\n\nFields\n------" + list};
}

/// Keyword constructor, properties, repr, to_dict, from_dict, fields, pickling, and validate when there is one.
/// What a property gives is a copy (arrays are read-only), except a struct inside a struct: assign the whole field.
/// `Base`: a struct bound before, from which T inherits.
template <HasFields T, class... Base>
py::class_<T, Base...> bind_struct(py::module_& m, const char* name, const char* doc) {
  const std::string own(name);
  const std::string full = m.attr("__name__").cast<std::string>() + "." + own;
  const auto [signature, field_list] = document<T>(full);
  py::class_<T, Base...> cls(m, name, (doc + field_list).c_str());
  {
    py::options options;
    options.disable_function_signatures();
    cls.def(py::init([own](const py::kwargs& kwargs) {
              T value;
              set_fields(value, kwargs, own);
              return value;
            }),
            signature.c_str());
  }
  std::size_t index = 0;
  const T defaults{};
  T::each_field(defaults, [&](const char* field, const auto& member, const char* field_doc) {
    using Member = std::remove_cvref_t<decltype(member)>;
    const std::size_t i = index++;
    const std::string where = own + "." + field;
    py::options options;
    options.disable_function_signatures();  // ours tell more
    const std::string get_text = "(self: " + full + ") -> " + Convert<Member>::text();
    const std::string set_text = "(self: " + full + ", value: " + Convert<Member>::argument() + ") -> None";
    const py::cpp_function set(
        [i, where](T& self, const py::object& value) {
          field_at<Member>(self, i) = Convert<Member>::from_python(value, where);
        },
        py::is_method(cls), set_text.c_str());
    if constexpr (HasFields<Member>)
      cls.def_property(
          field,
          py::cpp_function([i](T& self) -> Member& { return field_at<Member>(self, i); }, py::is_method(cls),
                           py::return_value_policy::reference_internal, get_text.c_str()),
          set, field_doc);
    else
      cls.def_property(field,
                       py::cpp_function([i](const T& self) { return frozen(field_at<Member>(self, i)); },
                                        py::is_method(cls), get_text.c_str()),
                       set, field_doc);
  });
  cls.def(
      "to_dict", [](const T& self) { return Convert<T>::to_plain(self); },
      "Nested dict of numbers, texts and lists, fit for JSON and YAML.");
  cls.def_static(
      "from_dict",
      [own](const py::dict& dict) {
        T value;
        set_fields(value, dict, own);
        return value;
      },
      py::arg("fields"), "Inverse of to_dict; fields that are absent keep their defaults.");
  cls.def_static("fields", &describe_fields<T>, "Name, type, default, doc and choices of every field.");
  cls.def("__repr__", [own](const T& self) { return own + short_text(self); });
  cls.def(py::pickle([](const T& self) { return Convert<T>::to_plain(self); },
                     [own](const py::dict& dict) {
                       T value;
                       set_fields(value, dict, own);
                       return value;
                     }));
  if constexpr (HasValidate<T>)
    cls.def(
        "validate", [](const T& self) { self.validate(); }, "Raises InvalidArgument naming the offending field.");
  return cls;
}

template <HasFields T>
T struct_from_python(const py::handle& value, const std::string& where) {
  if (py::isinstance<py::dict>(value)) {
    T out;
    set_fields(out, py::reinterpret_borrow<py::dict>(value), where);
    return out;
  }
  return cast_or_complain<T>(value, where);
}

}  // namespace kr5::python
