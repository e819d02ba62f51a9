// SPDX-License-Identifier: BSD-3-Clause
#include "field_table.hpp"

#include <string_view>

#include <kr5/core/fields.hpp>

#include "points_caster.hpp"

namespace kr5::python {
namespace {

/// `fields()`: what the command line makes its options from, and the guide its tables of keys.
py::list describe(const void* defaults, const Fields& fields) {
  py::list out;
  for (const Field& field : fields) {
    py::dict entry;
    entry["name"] = field.name;
    entry["type"] = field.type->text();
    entry["default"] = field.type->to_plain(field.in(defaults));
    entry["doc"] = field.doc;
    entry["unit"] = shown_unit(field.doc);
    entry["meaning"] = without_unit(field.doc);
    entry["covariance_of"] = py::str(field.covariance_of).attr("split")();
    entry["key"] = py::str(field.key.data(), field.key.size());
    entry["required"] = field.required;
    py::list choices;
    for (const std::string& choice : field.type->choices()) choices.append(choice);
    entry["choices"] = choices;
    out.append(entry);
  }
  return out;
}

/// Adds methods to a class whose type the compiler does not know, with signatures of our own, which tell more.
class Members {
 public:
  explicit Members(const py::object& cls)
      : cls_(cls),
        own_(cls.attr("__name__").cast<std::string>()),
        full_(cls.attr("__module__").cast<std::string>() + "." + own_) {
    options_.disable_function_signatures();
  }

  const std::string& own() const { return own_; }
  const std::string& full() const { return full_; }

  template <class Call>
  void method(const char* name, Call call, const std::string& takes, const std::string& gives, const char* doc) {
    const std::string text = name + ("(self: " + full_) + takes + ") -> " + gives + "\n\n" + doc;
    // pybind11 takes what is named __setstate__ for a constructor, and does not call it on an object that is made.
    const char* known_as = std::string_view(name) == "__setstate__" ? "set_state" : name;
    cls_.attr(name) = py::cpp_function(std::move(call), py::name(known_as), py::is_method(cls_), text.c_str());
  }

  template <class Call>
  void function(const char* name, Call call, const std::string& signature, const char* doc) {
    const std::string text = name + signature + "\n\n" + doc;
    const py::cpp_function made(std::move(call), py::name(name), py::scope(cls_), text.c_str());
    cls_.attr(name) = py::staticmethod(made);
  }

  template <class Get, class Set>
  void property(const Field& field, Get get, Set set) {
    const std::string self = "(self: " + full_;
    const std::string get_text = self + ") -> " + field.type->text();
    const std::string set_text = self + ", value: " + field.type->argument() + ") -> None";
    const py::cpp_function getter(std::move(get), py::is_method(cls_), get_text.c_str());
    const py::cpp_function setter(std::move(set), py::is_method(cls_), set_text.c_str());
    const py::handle type(reinterpret_cast<PyObject*>(&PyProperty_Type));
    cls_.attr(field.name) = type(getter, setter, py::none(), field.doc);
  }

 private:
  py::object cls_;
  std::string own_, full_;
  py::options options_;
};

/// While one lives, a struct shows its name alone: so it stands as a default in the signatures of functions.
class DefaultsByName {
 public:
  DefaultsByName() { set(true); }
  ~DefaultsByName() { set(false); }
  DefaultsByName(const DefaultsByName&) = delete;
  DefaultsByName& operator=(const DefaultsByName&) = delete;

 private:
  void set(bool value) { display_.attr("names_only") = value; }

  py::module_ display_ = py::module_::import("kr5._display");
};

void add_missing_displays(const py::module_& m) {
  const py::handle object(reinterpret_cast<PyObject*>(&PyBaseObject_Type));
  for (const auto& [name, value] : py::dict(m.attr("__dict__"))) {
    if (py::isinstance<py::module_>(value)) add_missing_displays(py::reinterpret_borrow<py::module_>(value));
    if (py::isinstance<py::type>(value) && value.attr("__repr__").is(object.attr("__repr__")))
      add_display(py::reinterpret_borrow<py::object>(value));
  }
}

}  // namespace

void add_display(const py::object& cls) {
  Members members(cls);
  members.method(
      "__repr__", [](const py::object& self) { return py::module_::import("kr5._display").attr("as_text")(self); }, "",
      "str", "");
  members.method(
      "_repr_html_", [](const py::object& self) { return py::module_::import("kr5._notebook").attr("as_html")(self); },
      "", "str", "Table for notebooks: figures with uncertainty and unit.");
}

void bind_with_displays(py::module_& m, void (*bind)(py::module_&)) {
  const DefaultsByName short_signatures;
  bind(m);
  add_missing_displays(m);
}

std::string shown_unit(std::string_view doc) {
  const std::string_view unit = unit_of(doc);
  return unit == "-" ? "" : std::string(unit);
}

std::string unknown_field(const std::string& where, const py::handle& name, const py::list& known) {
  const std::string key = py::str(name).cast<std::string>();
  const py::list near = py::module_::import("difflib").attr("get_close_matches")(key, known, 1, 0.5);
  const std::string hint = near.empty() ? "there are " + py::str(", ").attr("join")(known).cast<std::string>()
                                        : "did you mean '" + near[0].cast<std::string>() + "'?";
  return where + ": no field '" + key + "'; " + hint;
}

py::dict to_plain(const void* object, const Fields& fields) {
  py::dict out;
  for (const Field& field : fields) out[field.name] = field.type->to_plain(field.in(object));
  return out;
}

void set_fields(void* object, const Fields& fields, const py::dict& dict, const std::string& where) {
  py::list known;
  for (const Field& field : fields) {
    known.append(field.name);
    if (dict.contains(field.name)) field.type->assign(field.in(object), dict[field.name], where + "." + field.name);
  }
  for (const auto& [key, item] : dict)
    if (!known.contains(key)) throw py::type_error(unknown_field(where, key, known));
}

std::pair<std::string, std::string> document(const std::string& name, const Fields& fields) {
  std::string signature = "__init__(self: " + name, list;
  bool first = true;
  for (const Field& field : fields) {
    signature += std::string(first ? ", *, " : ", ") + field.name + ": " + field.type->argument() + " = ...";
    const std::string shape = field.type->shape();
    list += std::string("\n") + field.name + " : " + field.type->text() + (shape.empty() ? "" : " of shape " + shape) +
            "\n    " + field.doc;
    first = false;
  }
  return {signature + ") -> None\n\nFields that are not given keep their defaults.", "\n\nFields\n------" + list};
}

void add_members(const py::object& cls, const Fields& fields, void* (*pointer)(const py::handle&)) {
  Members members(cls);
  const Fields* all = &fields;
  const py::handle type = cls;  // which outlives its members
  for (const Field& field : fields)
    members.property(
        field, [pointer, &field](const py::object& self) { return field.type->get(field.in(pointer(self)), self); },
        [pointer, &field, where = members.own() + "." + field.name](const py::object& self, const py::object& value) {
          field.type->assign(field.in(pointer(self)), value, where);
        });
  members.method(
      "to_dict", [=](const py::object& self) { return to_plain(pointer(self), *all); }, "", "dict",
      "Nested dict of numbers, texts and lists, for JSON and YAML.");
  add_display(cls);
  members.method(
      "__reduce__",
      [=](const py::object& self) {
        return py::make_tuple(self.attr("__class__"), py::tuple(), to_plain(pointer(self), *all));
      },
      "", "tuple", "");
  members.method(
      "__setstate__",
      [=, own = members.own()](const py::object& self, const py::dict& state) {
        const PointsAreColumns as_written;
        set_fields(pointer(self), *all, state, own);
      },
      ", state: dict", "None", "");
  members.function(
      "from_dict",
      [=, own = members.own()](const py::dict& dict) {
        const PointsAreColumns as_written;
        py::object made = type();
        set_fields(pointer(made), *all, dict, own);
        return made;
      },
      "(fields: dict) -> " + members.full(), "Inverse of to_dict; missing fields keep their defaults.");
  members.function(
      "fields", [=] { return describe(pointer(type()), *all); }, "() -> list",
      "Of every field name, type, default, doc with its unit and its meaning apart, choices, and of which fields it is "
      "the covariance.");
}

}  // namespace kr5::python
