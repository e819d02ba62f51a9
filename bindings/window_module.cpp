// SPDX-License-Identifier: BSD-3-Clause
#include "../sim/window/window.hpp"

#include "struct_binder.hpp"

namespace py = pybind11;

PYBIND11_MODULE(_kr5_window, m) {
  py::module_::import("kr5._kr5");  // cells are bound there
  m.doc() = "DART's own window.";
  m.def(
      "show",
      [](const kr5::cell::Cell& cell, const std::vector<kr5::cell::PlacedObject>& objects, const Eigen::VectorXd& t,
         const Eigen::MatrixXd& q, const std::string& picture) {
        kr5::sim::show_window(cell, objects, {t, q}, picture);
      },
      py::arg("cell"), py::arg("objects"), py::arg("t"), py::arg("q"), py::arg("picture") = "",
      py::call_guard<py::gil_scoped_release>(),
      "Shows postures q (n x joints) over times t until the window is closed; with `picture`, saves one frame and "
      "ends.");
}
