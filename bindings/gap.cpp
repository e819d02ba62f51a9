// SPDX-License-Identifier: BSD-3-Clause
#include <optional>

#include <kr5/gap/measure.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::gap;

void bind_gap(py::module_& m) {
  m.doc() = "How far a simulation is from what was recorded.";
  kr5::python::bind_struct<ColumnGap>(m, "ColumnGap", "Gap of one column of one experiment.");
  kr5::python::bind_struct<Measure>(m, "Measure", "Gap of every column of a recording.");
  m.def(
      "measure",
      [](const kr5::cell::Recording& recording, const kr5::cell::Simulator& simulator,
         const std::optional<kr5::cell::Cell>& cell) {
        return measure(recording, cell ? *cell : recording.cell, simulator);
      },
      py::arg("recording"), py::arg("simulator"), py::arg("cell") = py::none(),
      py::call_guard<py::gil_scoped_release>(),
      "RMS of (recorded - simulated) over the noise, of every column that was recorded and is predicted: 1 is the "
      "floor. Without `cell`, that of the recording. Raises InvalidArgument for what the simulator cannot predict.");
}
