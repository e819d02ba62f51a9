// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>
#include <filesystem>

#include <pybind11/pybind11.h>

#include "_kr5_modules.hpp"
#include "field_table.hpp"

#include <kr5/core/error.hpp>

namespace py = pybind11;

/// Known to every extension that imports this one: pybind11 keeps the list of exceptions for all of them.
static void bind_errors(py::module_& m) {
  const auto& error = py::register_exception<kr5::Error>(m, "Error");
  error.attr("__doc__") = "Base of every exception of kr5.";
  py::register_exception<kr5::InvalidArgument>(m, "InvalidArgument",
                                               py::make_tuple(error, py::handle(PyExc_ValueError)))
      .attr("__doc__") = "The caller broke a documented precondition; nothing was computed.";
  static const py::object io_error =
      py::register_exception<kr5::IoError>(m, "IoError", py::make_tuple(error, py::handle(PyExc_OSError)));
  io_error.attr("__doc__") = "A file is missing, unreadable or not in the documented format.";
  // Names of files are bytes, which need not be UTF-8; what the file system refuses is an error of a file, too.
  const auto raise = [](const char* text) {
    const auto message = py::reinterpret_steal<py::object>(
        PyUnicode_DecodeUTF8(text, static_cast<Py_ssize_t>(std::strlen(text)), "backslashreplace"));
    PyErr_SetObject(io_error.ptr(), message.ptr());
  };
  static const auto translate = raise;
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const kr5::IoError& e) {
      translate(e.what());
    } catch (const std::filesystem::filesystem_error& e) {
      translate((e.path1().string() + ": cannot be read: " + e.code().message()).c_str());
    }
  });
}

PYBIND11_MODULE(_kr5, m) {
  m.doc() = "The C++ library, without vision. Import it as kr5, kr5.calibration, ...";
  m.attr("__version__") = KR5_VERSION;
  bind_errors(m);
  kr5::python::bind_with_displays(m, bind_modules);
}
