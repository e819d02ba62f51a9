// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/fit_report.hpp>

#include "struct_binder.hpp"

using namespace kr5;

void bind_core(pybind11::module_& m) {
  python::bind_enum<FitStatus>(m, "FitStatus", "How an estimation ended.");
  python::bind_struct<FitReport>(m, "FitReport", "The part of a result that every estimator shares.")
      .def_property_readonly("usable", &FitReport::usable, "False when the data do not determine the answer.");
}
