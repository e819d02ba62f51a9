// SPDX-License-Identifier: BSD-3-Clause
#include <utility>
#include <vector>

#include <kr5/work/job_runner.hpp>
#include <kr5/work/plan_work.hpp>

#include "grey_array.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::work;
using kr5::python::bind_struct;

namespace {

void bind_options(py::module_& m) {
  bind_struct<WorkOptions>(m, "WorkOptions", "What a job in a cell is done with.");
  m.def("work_options", &work_options, py::arg("cell"),
        "Options for a simulated cell, from what its controller is told of it. InvalidArgument names what the cell "
        "lacks.");
  m.def("restart_options", &restart_options, py::arg("options"),
        "Options of kr5.job.decide_restart that agree with those of the job.");
}

void bind_perception(py::module_& m) {
  m.def(
      "plan_work",
      [](const kr5::picking::Cloud& cloud, const kr5::cell::Cell& believed, const WorkOptions& options) {
        kr5::job::ScanResult found;
        {
          const py::gil_scoped_release free;
          found = plan_work(cloud, believed, options);
        }
        const auto end = found.picks.begin() + found.count;
        return std::make_pair(std::vector<kr5::job::PlannedPick>(found.picks.begin(), end), found.bin_empty);
      },
      py::arg("cloud"), py::arg("believed"), py::arg("options"),
      "Picks of a cloud of the bin in the base [m], the best first, each with its way over the stand, and whether the "
      "bin is empty. Those whose poses the arm does not reach are left out.");
  m.def(
      "find_tube",
      [](const kr5::python::GreyArray& picture, const kr5::cell::Cell& believed, const kr5::Pose& T_base_flange,
         const WorkOptions& options) {
        const kr5::ImageView view = kr5::python::view_of(picture);
        const py::gil_scoped_release free;
        return find_tube(view, believed, T_base_flange, options);
      },
      py::arg("picture"), py::arg("believed"), py::arg("T_base_flange"), py::arg("options"),
      "The tube in a grey picture (uint8, height x width), where its face is believed to lie; T_base_flange (4x4) [m] "
      "when the picture was taken. InvalidArgument for a cell without camera.");
}

void bind_runner(py::module_& m) {
  py::class_<JobRun>(m, "JobRun", "How a job ended, and what was measured meanwhile.")
      .def_property_readonly("done", &JobRun::done, "Whether nothing is left to do.")
      .def_property_readonly(
          "decision", [](const JobRun& r) { return r.decision; }, "Where the job went on (a copy).")
      .def_property_readonly(
          "state", [](const JobRun& r) { return r.state; }, "How it ended (a copy).")
      .def_property_readonly(
          "statistics", [](const JobRun& r) { return r.statistics; }, "Figures of the job (a copy).")
      .def_property_readonly(
          "rows", [](const JobRun& r) { return r.rows; },
          "Rows of this program, one a cycle: time [s]; phase (index in kr5.job.Phase), pellet, attempt; gripped, "
          "hold, "
          "fingers; set_x .. set_rz, where the tool shall be, and tool_x .. tool_rz, where it is, in B [m, rad]; "
          "fx .. tz on the tool, in B [N, N m]; q1..n [rad or m] and i1..n [A] (a copy).");
  py::class_<JobRunner>(
      m, "JobRunner",
      "A program that takes up what a journal says, and goes on cycle by cycle: the cell is read, the "
      "controller asked, scans and pictures are answered, records are on the disk. InvalidArgument "
      "for invalid options.")
      .def(
          py::init<kr5::sim::WorkCell&, const WorkOptions&, kr5::job::Journal&, const kr5::job::RestartMeasurements&>(),
          py::arg("cell"), py::arg("options"), py::arg("journal"), py::arg("seen") = kr5::job::RestartMeasurements{},
          py::keep_alive<1, 2>(), py::keep_alive<1, 4>())
      .def_property_readonly(
          "decision", [](const JobRunner& self) { return self.decision(); }, "Where the job goes on, or why it cannot.")
      .def_property_readonly("runs", &JobRunner::runs, "Whether the job can go on by that.")
      .def_property_readonly("finished", &JobRunner::finished, "Whether nothing moves any more.")
      .def_property_readonly(
          "state", [](const JobRunner& self) { return self.state(); },
          "State of the job; InvalidArgument for one that does not run.")
      .def_property_readonly(
          "command", [](const JobRunner& self) { return self.command(); }, "Command of the last cycle.")
      .def(
          "step",
          [](JobRunner& self, int cycles) {
            for (int k = 0; k < cycles && !self.finished(); ++k) self.step();
          },
          py::arg("cycles") = 1, py::call_guard<py::gil_scoped_release>(),
          "So many cycles, or fewer where the job ends. IoError when the journal cannot be written.")
      .def("result", &JobRunner::result, "What there is so far.");
}

void bind_truth(py::module_& m) {
  bind_struct<JobTruth>(m, "JobTruth", "What is so at the end of a job. Not for controllers.");
  m.def("judge_job", &judge_job, py::arg("cell"), "Where the pellets of a cell are by its truth.");
  m.def("place_over_bin", &place_over_bin, py::arg("cell"), py::arg("options"),
        "Stands with the arm, at rest, where the scan of the bin begins. InvalidArgument when it cannot reach it.");
}

}  // namespace

void bind_work(py::module_& m) {
  bind_options(m);
  bind_perception(m);
  bind_runner(m);
  bind_truth(m);
}
