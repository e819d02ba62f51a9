// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/fit_report.hpp>

#include "struct_binder.hpp"

using namespace kr5;

void bind_core(pybind11::module_& m) {
  // What the documentation of a property says, for the repr of classes that have no list of fields.
  m.def("_unit_of", &python::shown_unit, pybind11::arg("doc"));
  m.def("_without_unit", &without_unit, pybind11::arg("doc"));
  python::bind_enum<FitStatus>(m, "FitStatus", "Status of an estimation.");
  python::bind_struct<FitReport>(m, "FitReport", "Report of an estimation, shared by every estimator.")
      .def_property_readonly("usable", &FitReport::usable, "False when the data do not determine the answer.");
}
