// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <utility>
#include <vector>

#include <pybind11/stl/filesystem.h>

#include <kr5/work/arm_ways.hpp>
#include <kr5/work/fault_trials.hpp>
#include <kr5/work/job_runner.hpp>
#include <kr5/work/linked_job.hpp>
#include <kr5/work/look_at_places.hpp>
#include <kr5/work/plan_work.hpp>

#include "grey_array.hpp"
#include "joint_vector_conversion.hpp"
#include "progress.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::work;
using kr5::python::bind_struct;

namespace {

void bind_options(py::module_& m) {
  bind_struct<ArmWayOptions>(m, "ArmWayOptions", "How ways from place to place are planned.");
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
        return std::make_tuple(std::vector<kr5::job::PlannedPick>(found.picks.begin(), end), found.bin_empty,
                               found.unreachable);
      },
      py::arg("cloud"), py::arg("believed"), py::arg("options"),
      "Picks of a cloud of the bin in the base [m], the best first, each with its way over the stand; whether the bin "
      "is "
      "empty; and the number of pellets that are left out since the arm cannot bring them into the tube. All of it is "
      "what kr5.job.Supervisor.deliver_scan takes.");
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

void bind_looks(py::module_& m) {
  m.def("look_at_stand", &look_at_stand, py::arg("cloud"), py::arg("options"),
        "Whether a pellet is on the stand, in a cloud of it in the base [m].");
  m.def("look_at_tube", &look_at_tube, py::arg("cloud"), py::arg("believed"), py::arg("options"),
        "Whether a pellet stands out of the tube, and how deep its bore is free, in a cloud of it in the base [m].");
}

void bind_ways(py::module_& m) {
  bind_struct<ArmStop>(m, "ArmStop", "Place at which a way ends and the next one begins.");
  bind_struct<WayPlan>(m, "WayPlan", "Ways through some places.")
      .def_property_readonly("possible", &WayPlan::possible, "Whether the arm comes to every place.");
  m.def(
      "plan_ways",
      [](const kr5::cell::Cell& believed, const Eigen::VectorXd& joints, const std::vector<ArmStop>& stops,
         const WorkOptions& options) { return plan_ways(believed, joints, stops, options); },
      py::arg("believed"), py::arg("joints"), py::arg("stops"), py::arg("options"),
      py::call_guard<py::gil_scoped_release>(),
      "Postures at places and full turns of the joints, by which the ways from joints (n,) [rad or m] on take the "
      "least "
      "time within the limits.");
  m.def("stops_ahead", &stops_ahead, py::arg("asked"), py::arg("options"),
        "Where the tool goes from the end of a way until the pellet is in the tube, and back over the bin.");
  m.def("plan_way", &plan_way, py::arg("asked"), py::arg("believed"), py::arg("joints"), py::arg("options"),
        py::call_guard<py::gil_scoped_release>(),
        "The way that a supervisor asks for, from joints (n,) as they are when it does [rad or m]; it is delivered by "
        "kr5.job.Supervisor.deliver_way.");
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
      "controller asked, scans and pictures are answered, records are on the disk; before "
      "each record the state of the cell is written to `cell_file`, where one is named. InvalidArgument for invalid "
      "options.")
      .def(py::init<kr5::sim::WorkCell&, const WorkOptions&, kr5::job::Journal&, const kr5::job::RestartMeasurements&,
                    const std::filesystem::path&>(),
           py::arg("cell"), py::arg("options"), py::arg("journal"), py::arg("seen") = kr5::job::RestartMeasurements{},
           py::arg("cell_file") = "", py::keep_alive<1, 2>(), py::keep_alive<1, 4>())
      .def_property_readonly(
          "decision", [](const JobRunner& self) { return self.decision(); }, "Where the job goes on, or why it cannot.")
      .def_property_readonly("runs", &JobRunner::runs, "Whether the job can go on by that.")
      .def_property_readonly("finished", &JobRunner::finished, "Whether nothing moves any more.")
      .def_property_readonly(
          "state", [](const JobRunner& self) { return self.state(); },
          "State of the job; InvalidArgument for one that does not run.")
      .def_property_readonly(
          "reading", [](const JobRunner& self) { return self.reading(); },
          "What the robot told in the last cycle of this program; InvalidArgument for a job that does not run.")
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

void bind_linked_options(py::module_& m) {
  bind_struct<LinkedOptions>(m, "LinkedOptions", "Both ends of the link that a job runs through.");
  m.def(
      "linked_options", &linked_options, py::arg("options"), py::arg("believed"),
      py::arg("controller") = kr5::rsi::Controller::Krc4,
      "Options by which a link lets the motions of a job pass: limits of corrections at both ends, telegrams, cycle.");
  m.def("program_options", &program_options, py::arg("options"),
        "Options of kr5.rsi.controller_files for a real controller with the same limits.");
  py::class_<LinkedRun>(m, "LinkedRun", "How a job through a link ended, and what both ends saw.")
      .def_property_readonly(
          "job", [](const LinkedRun& r) { return r.job; }, "How the job ended (a copy).")
      .def_property_readonly(
          "link", [](const LinkedRun& r) { return r.link; }, "What the link has seen (a copy).")
      .def_property_readonly(
          "controller", [](const LinkedRun& r) { return r.controller; }, "What the controller has seen (a copy).");
}

/// Steps or serves while a job runs.
template <class Job, class Class>
void bind_linked(Class& bound) {
  bound
      .def_property_readonly(
          "decision", [](const Job& self) { return self.decision(); }, "Where the job goes on, or why it cannot.")
      .def_property_readonly("runs", &Job::runs, "Whether the job can go on by that.")
      .def_property_readonly("finished", &Job::finished, "Whether nothing moves any more.")
      .def_property_readonly(
          "state", [](const Job& self) { return self.state(); },
          "State of the job; InvalidArgument for one that does not run.")
      .def("stop_by_operator", &Job::stop_by_operator, "Stops the arm; a person must release it.")
      .def(
          "run", [](Job& self) { return self.run(); }, py::call_guard<py::gil_scoped_release>(),
          "Until the job has ended and the arm stands.");
}

void bind_linked_jobs(py::module_& m) {
  using free_python = py::call_guard<py::gil_scoped_release>;
  using kr5::job::Journal;
  using kr5::job::RestartMeasurements;
  py::class_<LockstepJob> lockstep(m, "LockstepJob",
                                   "A job through an RSI link without sockets and clocks: controller and link in "
                                   "turns, as fast as both can.");
  bind_linked<LockstepJob>(lockstep);
  lockstep
      .def(py::init([](kr5::sim::WorkCell& cell, const WorkOptions& options, const LinkedOptions& linked,
                       Journal& journal, const RestartMeasurements& seen) {
             return std::make_unique<LockstepJob>(cell, options, linked, journal, seen);
           }),
           py::arg("cell"), py::arg("options"), py::arg("linked"), py::arg("journal"),
           py::arg("seen") = RestartMeasurements{}, py::keep_alive<1, 2>(), py::keep_alive<1, 5>())
      .def(
          "step",
          [](LockstepJob& self, int cycles) {
            for (int k = 0; k < cycles; ++k) self.step();
          },
          py::arg("cycles") = 1, free_python(), "So many cycles of both ends, also of a job that has ended.")
      .def_property_readonly("controller", &LockstepJob::controller, py::return_value_policy::reference_internal,
                             "The emulated controller.")
      .def("jump_clock", &LockstepJob::jump_clock, py::arg("time"), "The clock of the computer jumps ahead [s].")
      .def("result", &LockstepJob::result, "What there is so far.");
  py::class_<LinkedJob> linked(m, "LinkedJob",
                               "A job in real time through an RSI link with its sockets, with an emulated controller "
                               "that moves the cell meanwhile: nobody else may use cell and journal until it has "
                               "ended.");
  bind_linked<LinkedJob>(linked);
  linked
      .def(py::init([](kr5::sim::WorkCell& cell, const WorkOptions& options, const LinkedOptions& to, Journal& journal,
                       const RestartMeasurements& seen, const std::filesystem::path& cell_file) {
             return std::make_unique<LinkedJob>(cell, options, to, journal, seen, kr5::rsi::ExchangeFunction(),
                                                cell_file);
           }),
           py::arg("cell"), py::arg("options"), py::arg("linked"), py::arg("journal"),
           py::arg("seen") = RestartMeasurements{}, py::arg("cell_file") = "", py::keep_alive<1, 2>(),
           py::keep_alive<1, 5>())
      .def("serve", &LinkedJob::serve, free_python(),
           "Looks, rows and a lost link since the last call, which must be a few milliseconds ago.")
      .def_property_readonly(
          "reading", [](const LinkedJob& self) { return self.reading(); },
          "What the robot told in the last cycle that was served; InvalidArgument for a job that does not run.")
      .def("end", &LinkedJob::end, free_python(), "Ends both ends of the link; what there is then.")
      .def("cell_state", &LinkedJob::cell_state, free_python(), "The cell as it is now.")
      .def("cell_truth", &LinkedJob::cell_truth, free_python(), "What is so in it now. Not for controllers.")
      .def_property_readonly("controller", &LinkedJob::controller, py::return_value_policy::reference_internal,
                             "The emulated controller, until the job is ended; InvalidArgument when it does not run.")
      .def_property_readonly("written", &LinkedJob::written, "Number of the last record on the disk.")
      .def_property_readonly("journal_problem", &LinkedJob::journal_problem,
                             "Why the journal could not be written, in words; empty: it could.")
      .def_property_readonly("real_time", &LinkedJob::real_time, "What the kernel gave to the thread of the link.");
}

void bind_trials(py::module_& m) {
  kr5::python::bind_enum<TrialFault>(m, "TrialFault", "A fault of a link, or of one of its ends.");
  bind_struct<FaultTrialOptions>(m, "FaultTrialOptions", "Options of run_fault_trials.");
  bind_struct<FaultRow>(m, "FaultRow", "What came of the trials of one fault, by the truth of the simulator.");
  m.def(
      "run_fault_trials",
      [](const kr5::cell::Cell& cell, const kr5::sim::WorkCellOptions& bin, const std::string& folder,
         const FaultTrialOptions& options, const py::object& progress) {
        const auto told = kr5::python::shared_progress(progress);
        const py::gil_scoped_release free;
        return run_fault_trials(cell, bin, folder, options, [&](double share) {
          const py::gil_scoped_acquire held;
          if (PyErr_CheckSignals() != 0) throw py::error_already_set();
          if (told) told("faults", share);
        });
      },
      py::arg("cell"), py::arg("bin"), py::arg("folder"), py::arg("options") = FaultTrialOptions{},
      py::arg("progress") = py::none(),
      "Injects each fault at random instants of an insertion through a link in lock step; what was stopped is released "
      "by a person and goes on. progress(stage, share) is called after each trial.");
}

}  // namespace

void bind_work(py::module_& m) {
  bind_options(m);
  bind_perception(m);
  bind_looks(m);
  bind_ways(m);
  bind_runner(m);
  bind_truth(m);
  bind_linked_options(m);
  bind_linked_jobs(m);
  bind_trials(m);
}
