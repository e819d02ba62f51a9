// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/fast_simulator.hpp>

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
}
