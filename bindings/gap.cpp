// SPDX-License-Identifier: BSD-3-Clause
#include <functional>
#include <optional>

#include <kr5/gap/diagnose.hpp>
#include <kr5/gap/measure.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::gap;

namespace {

/// A Python callable that may be called from any thread, without the interpreter held.
std::function<void(const std::string&, double)> shared(const py::object& progress) {
  if (progress.is_none()) return {};
  return [progress](const std::string& stage, double fraction) {
    const py::gil_scoped_acquire held;
    progress(stage, fraction);
  };
}

void bind_diagnosis(py::module_& m) {
  using kr5::python::bind_enum;
  using kr5::python::bind_struct;
  bind_enum<Verdict>(m, "Verdict", "no_gap | explained | partly_explained | unknown.");
  bind_struct<Dependence>(m, "Dependence", "A tested dependence of a residual on what the cell was doing.");
  bind_struct<Place>(m, "Place", "The gap of one column over all experiments of a kind.");
  bind_struct<ParameterEstimate>(m, "ParameterEstimate", "A parameter as the cell would hold it.");
  bind_struct<EffectName>(m, "EffectName", "An effect and its target.");
  bind_struct<Cause>(m, "Cause", "An effect that is blamed.");
  bind_struct<ColumnShrink>(m, "ColumnShrink", "Gap of a column before and after.");
  bind_struct<Shrink>(m, "Shrink", "How far the gap shrinks.");
  bind_struct<NextExperiment>(m, "NextExperiment", "What would tell tied effects apart.");
  bind_struct<Diagnosis>(m, "Diagnosis", "Why a simulation and a cell disagree (kr5-gap/1).")
      .def("to_json", &to_json, "The text of format kr5-gap/1.")
      .def_property_readonly(
          "cell", [](const Diagnosis& d) { return d.cell; }, "The nominal cell with the causes added (a copy).");
  bind_struct<DiagnoseOptions>(m, "DiagnoseOptions", "Options of diagnose.");
  m.def(
      "diagnose",
      [](const kr5::cell::Recording& recording, const kr5::cell::Simulator& simulator, DiagnoseOptions options,
         const py::object& progress) {
        options.progress = shared(progress);
        const py::gil_scoped_release released;
        return diagnose(recording, simulator, options);
      },
      py::arg("recording"), py::arg("simulator"), py::arg("options") = DiagnoseOptions{},
      py::arg("progress") = py::none(),
      "Where the gap lies, which effects cause it, how far it shrinks and what stays unknown. `progress(stage, "
      "fraction)` is called from time to time, from any thread.");
}

}  // namespace

void bind_gap(py::module_& m) {
  bind_diagnosis(m);
  m.doc() = "How far a simulation is from what was recorded, and why.";
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
