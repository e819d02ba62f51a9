// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/tool.hpp>
#include <kr5/predict/camera_scene.hpp>
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
  kr5::python::bind_struct<CameraScene>(m, "CameraScene",
                                        "What a camera of a cell has before it, with the effects it carries.");
  m.def("T_flange_tool", &kr5::physics::tool_offset, py::arg("cell"),
        "Tool tip in the flange, with the effects that the cell carries; the flange itself for a cell without tool.");
  m.def("camera_scene", &camera_scene, py::arg("cell"), py::arg("T_base_flange"),
        py::arg("objects") = std::vector<kr5::cell::PlacedObject>(),
        "What the camera has before it for a pose of the flange: targets, tube and sphere of the cell, and the objects "
        "given. Raises InvalidArgument naming the part of the cell that is not there.");
}
