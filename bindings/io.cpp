// SPDX-License-Identifier: BSD-3-Clause
#include <optional>

#include <kr5/core/error.hpp>
#include <kr5/io/column_unit.hpp>
#include <kr5/io/csv.hpp>
#include <kr5/io/diagnostic.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::io;

namespace {

void bind_units(py::module_& m) {
  kr5::python::bind_struct<ColumnUnit>(m, "ColumnUnit", "Unit in which numbers may be given.");
  kr5::python::bind_struct<UnitName>(m, "UnitName", "Name of a column, and the unit that it ends in.");
  m.def("column_units", &column_units,
        "All units of columns; those of a quantity follow each other, that of SI first: list of ColumnUnit.");
  m.def(
      "find_unit",
      [](const std::string& text) -> std::optional<ColumnUnit> {
        const ColumnUnit* unit = find_unit(text);
        return unit ? std::optional(*unit) : std::nullopt;
      },
      py::arg("text"),
      "Unit that a text means, also in another spelling (degrees, sec, ma); None where it means none.");
  m.def("split_unit", &split_unit, py::arg("column"),
        "Takes the unit off the name of a column (q1 [deg], tx (N mm), x_mm): UnitName.");
}

}  // namespace

void bind_io(py::module_& m) {
  m.doc() = "Tables of numbers, units of columns, and diagnostics of files.";
  bind_units(m);
  kr5::python::bind_enum<Severity>(m, "Severity", "Severity of a diagnostic.");
  kr5::python::bind_struct<Diagnostic>(m, "Diagnostic", "Error or warning about a file.")
      .def("text", &Diagnostic::text, "`file:line: field: found ..., expected ...`")
      .def("__str__", &Diagnostic::text);
  py::class_<Table>(m, "Table", "Table of numbers in named columns.")
      .def(py::init([](std::vector<std::string> columns, Eigen::MatrixXd values) {
             kr5::require(values.cols() == static_cast<Eigen::Index>(columns.size()),
                          "as many names as columns of values");
             return Table{std::move(columns), std::move(values)};
           }),
           py::arg("columns"), py::arg("values"))
      .def_property_readonly(
          "columns", [](const Table& t) { return t.columns; }, "Names of the columns, in the order of the file.")
      .def_property_readonly(
          "values", [](const Table& t) { return t.values; }, "Values, one row per line (a copy).")
      .def(
          "__contains__", [](const Table& t, const std::string& name) { return t.find(name) >= 0; }, py::arg("name"))
      .def(
          "__getitem__", [](const Table& t, const std::string& name) { return t.column(name); }, py::arg("name"),
          "Column as an array. Raises InvalidArgument, with the existing columns, for an unknown one.")
      .def(
          "__len__", [](const Table& t) { return t.values.rows(); }, "Number of rows.")
      .def("__repr__", [](const Table& t) {
        return "Table(" + std::to_string(t.values.rows()) + " rows of " + std::to_string(t.columns.size()) +
               " columns)";
      });
  m.def("load_csv", &load_csv, py::arg("file"), py::call_guard<py::gil_scoped_release>(),
        "Reads a table of numbers under a header line. Raises IoError with file, line and column of every error.");
  m.def("parse_csv", &parse_csv, py::arg("text"), py::arg("source"),
        "The same from the text of a table; `source` names it in errors.");
  m.def("save_csv", &save_csv, py::arg("table"), py::arg("file"), py::call_guard<py::gil_scoped_release>(),
        "Writes a table; numbers read back exactly.");
}
