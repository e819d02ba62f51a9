// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/tool.hpp>
#include <kr5/predict/camera_scene.hpp>
#include <kr5/predict/cell_objects.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::predict;

void bind_predict(py::module_& m) {
  m.doc() = "Prediction of sensor readings without a physics engine.";
  py::class_<FastSimulator, kr5::cell::Simulator>(
      m, "FastSimulator",
      "Fast simulator: inverse dynamics on the response of the servos, closed-form contact, projection, with all "
      "effects of the cell. Readings outside the range of a sensor are NaN.")
      .def(py::init<>())
      .def("__repr__", [](const FastSimulator&) { return "FastSimulator()"; });
  kr5::python::bind_struct<CameraScene>(m, "CameraScene",
                                        "Scene before the camera of a cell, with the effects of the cell.");
  m.def("T_flange_tool", &kr5::physics::tool_offset, py::arg("cell"),
        "Tool tip in the flange, with the effects of the cell; the flange itself for a cell without tool.");
  m.def("scanner_objects", &scanner_objects, py::arg("cell"),
        "What rays of the scanner may meet: tube, board and targets, sphere and plane of the scanner's target. The "
        "plane, of which a cell states only the height, reaches 10 m from the base.");
  m.def("camera_scene", &camera_scene, py::arg("cell"), py::arg("T_base_flange"),
        py::arg("objects") = std::vector<kr5::cell::PlacedObject>(),
        "Scene before the camera for a pose of the flange: targets, tube and sphere of the cell, and the given "
        "objects. Raises InvalidArgument naming the missing part of the cell.");
}
