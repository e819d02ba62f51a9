// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>

/// @file
/// The field list of a struct with its types erased, and all that Python does with it. A class made from a list needs
/// next to no code of its own, which would take the compiler minutes.

namespace kr5::python {

namespace py = pybind11;

struct Field;
using Fields = std::vector<Field>;

/// How one type of field goes to and from Python; what Convert (conversion.hpp) says, and more.
struct FieldType {
  std::string (*text)();
  std::string (*argument)();
  std::string (*shape)();  ///< Of an array, as the documentation of its struct says it; empty for other types.
  py::object (*to_plain)(const void* value);
  void (*assign)(void* value, const py::handle& from, const std::string& where);
  /// What a property hands out: a copy, and an array that cannot be written, lest somebody believe it changes the
  /// struct; of a struct the member itself, kept alive by its owner.
  py::object (*get)(void* value, const py::handle& owner);
  std::vector<std::string> (*choices)();  ///< Names an enumeration may have; empty for other types.
  const Fields& (*fields)();              ///< Of a struct; else null.
};

struct Field {
  const char* name;
  const char* doc;
  const char* covariance_of;  ///< Fields whose covariance it is, with blanks between; empty for other fields.
  std::string_view key;       ///< In a file.
  bool required;              ///< In a file.
  std::ptrdiff_t offset;      ///< In the struct [bytes].
  const FieldType* type;

  const void* in(const void* object) const { return static_cast<const char*>(object) + offset; }
  void* in(void* object) const { return static_cast<char*>(object) + offset; }
};

/// Sentence for a name that is not among `known`, with the nearest one.
std::string unknown_field(const std::string& where, const py::handle& name, const py::list& known);

/// The unit in what is said of a field, as tables show it: empty for a plain number.
std::string shown_unit(std::string_view doc);

/// Nested dict of numbers, texts and lists.
py::dict to_plain(const void* object, const Fields& fields);

/// Sets the members that `dict` names. Fields that are absent keep their values.
/// @throws TypeError for an unknown name, or a value of the wrong type.
void set_fields(void* object, const Fields& fields, const py::dict& dict, const std::string& where);

/// Texts for people and for the stubs: the signature of the constructor, and the list of fields.
std::pair<std::string, std::string> document(const std::string& name, const Fields& fields);

/// Gives a class its repr and its table in notebooks, both made from its fields or, without those, its properties.
void add_display(const py::object& cls);

/// Binds a module, and gives them to every class of it and its submodules that has no repr of its own.
void bind_with_displays(py::module_& m, void (*bind)(py::module_&));

/// Gives a class its properties, repr, to_dict, from_dict, fields and pickling.
/// @param pointer where the struct of an instance lies
void add_members(const py::object& cls, const Fields& fields, void* (*pointer)(const py::handle&));

}  // namespace kr5::python
