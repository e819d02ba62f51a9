// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/fast_simulator.hpp>
#include <kr5/predict/sight.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::predict;

void bind_predict(py::module_& m) {
  m.doc() = "What the sensors of a cell would show, without a physics engine.";
  py::class_<FastSimulator, kr5::cell::Simulator>(
      m, "FastSimulator",
      "The fast grade of a simulator: inverse dynamics on the response of the servos, closed-form contact, "
      "projection. All effects that the cell carries act. What a sensor cannot see is NaN.")
      .def(py::init<>())
      .def("__repr__", [](const FastSimulator&) { return "FastSimulator()"; });
  kr5::python::bind_struct<Sight>(m, "Sight", "What a camera of a cell has before it, as it really is.");
  m.def(
      "sight", &sight, py::arg("cell"), py::arg("T_B_F"), py::arg("things") = std::vector<kr5::cell::Thing>(),
      "What the camera has before it when the flange is at T_B_F: the cell's targets, tube and sphere, and the things "
      "given. Raises InvalidArgument naming the part of the cell that is not there.");
}
