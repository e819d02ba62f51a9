// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/pybind11.h>

#include "_kr5_modules.hpp"

#include <kr5/core/error.hpp>

namespace py = pybind11;

/// Known to every extension that imports this one: pybind11 keeps the list of exceptions for all of them.
static void bind_errors(py::module_& m) {
  const auto& error = py::register_exception<kr5::Error>(m, "Error");
  error.attr("__doc__") = "Base of every exception of kr5.";
  py::register_exception<kr5::InvalidArgument>(m, "InvalidArgument",
                                               py::make_tuple(error, py::handle(PyExc_ValueError)))
      .attr("__doc__") = "The caller broke a documented precondition; nothing was computed.";
  py::register_exception<kr5::IoError>(m, "IoError", py::make_tuple(error, py::handle(PyExc_OSError))).attr("__doc__") =
      "A file is missing, unreadable or not of the documented form.";
}

PYBIND11_MODULE(_kr5, m) {
  m.doc() = "The C++ library, without vision. Import it as kr5, kr5.calibration, ...";
  m.attr("__version__") = KR5_VERSION;
  bind_errors(m);
  bind_modules(m);
}
