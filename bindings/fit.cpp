// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/cell_fit.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::fit;

void bind_fit(py::module_& m) {
  m.doc() = "Fit of a cell to any mixture of measurements.";
  kr5::python::bind_struct<UnidentifiableDirection>(m, "UnidentifiableDirection",
                                                    "Combination of parameters that the measurements leave open.");
}
