// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <memory>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/job/job_statistics.hpp>
#include <kr5/job/journal_writer.hpp>
#include <kr5/job/supervisor.hpp>

#include "joint_vector_conversion.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::job;
using kr5::python::bind_enum;
using kr5::python::bind_struct;

namespace {

void bind_phases(py::module_& m) {
  bind_enum<Phase>(m, "Phase", "Phase of a job.");
  bind_enum<Outcome>(m, "Outcome", "What ends a phase.");
  bind_enum<PelletState>(m, "PelletState", "Where a pellet of a job is.");
  bind_enum<StopReason>(m, "StopReason", "What stopped the arm.");
  bind_struct<PhaseExit>(m, "PhaseExit", "What follows an outcome.");
  bind_struct<PhaseRow>(m, "PhaseRow", "Limits and exits of a phase.");
  bind_struct<PhaseTable>(m, "PhaseTable", "State machine of a job.");
  m.def("usual_phases", &usual_phases, "Table of the job from bin to tube.");
}

void bind_journal(py::module_& m) {
  bind_enum<RecordKind>(m, "RecordKind", "Kind of a record: begin | enter | attempt | pellet | stop | release.");
  bind_struct<StationPlan>(m, "StationPlan", "How a pellet goes over the station.");
  bind_struct<JobRecord>(m, "JobRecord", "What is written of a job, before it happens.");
  bind_struct<PelletEntry>(m, "PelletEntry", "A pellet that was tried.");
  bind_struct<JobBelief>(m, "JobBelief", "How a job stands, by its records.");
  m.attr("journal_version") = journal_version;
  m.def(
      "believe", [](const std::vector<JobRecord>& records) { return believe(records); }, py::arg("records"),
      "What records say, the oldest first.");
  m.def("journal_job", &journal_job, py::arg("file"), "Id of the job that a database belongs to.");
  py::class_<Journal>(m, "Journal",
                      "Records of a job on a disk, written ahead. Opens the database of a job, or makes it; raises "
                      "IoError for one of another job, version or program, or one that is in use.")
      .def(py::init<const std::filesystem::path&, const std::string&>(), py::arg("file"), py::arg("job"))
      .def(
          "append", [](Journal& self, const std::vector<JobRecord>& records) { self.append(records); },
          py::arg("records"), "Writes records, all or none, and returns when they are on the disk.")
      .def("release", &Journal::release, py::arg("person"), "A person releases the stop.")
      .def("records", &Journal::records, "All records, the oldest first.")
      .def("belief", &Journal::belief, "How the job stands.")
      .def_property_readonly("last_number", &Journal::last_number, "Number of the last record.")
      .def_property_readonly("job", &Journal::job, "Id of the job.")
      .def_property_readonly("released_by", &Journal::released_by, "Who released a stop last; empty: nobody.");
}

void bind_restart(py::module_& m) {
  bind_struct<RestartMeasurements>(m, "RestartMeasurements", "What is measured before anything moves.");
  bind_struct<RestartOptions>(m, "RestartOptions", "Options of decide_restart.");
  bind_enum<RestartStatus>(m, "RestartStatus", "Whether a job can go on.");
  m.def("goes_on", &goes_on, py::arg("status"), "Whether a job begins, or goes on, by such a decision.");
  bind_enum<RestartFinding>(m, "RestartFinding", "What the comparison of journal and measurements found.");
  bind_struct<RestartDecision>(m, "RestartDecision", "Where a job goes on.");
  m.def("decide_after_look", &decide_after_look, py::arg("before"), py::arg("seen"), py::arg("stack"),
        "Decides anew, once the place that a decision to look names has been seen.");
  m.def("decide_restart", &decide_restart, py::arg("belief"), py::arg("measurements"),
        py::arg("options") = RestartOptions{}, "Compares journal and measurements, and decides where the job goes on.");
}

void bind_perception(py::module_& m) {
  bind_enum<RequestKind>(m, "RequestKind", "What a supervisor asks for.");
  bind_struct<StationVisit>(m, "StationVisit", "A pellet is put on the station and taken up again.");
  bind_struct<PlannedPick>(m, "PlannedPick", "How one pellet goes from the bin to the tube's gripper.");
  bind_struct<WayRequest>(m, "WayRequest", "Way that is asked for, and what is to follow it.");
  bind_struct<PerceptionRequest>(m, "PerceptionRequest", "What is to be looked at or planned.");
  bind_struct<HoleResult>(m, "HoleResult", "Where the tube is.");
  bind_struct<PlaceResult>(m, "PlaceResult", "What was seen at the station or the tube.");
  bind_struct<JointWay>(m, "JointWay", "Way of all joints from rest to rest along a parabola.")
      .def("at", &JointWay::at, py::arg("share"), "Joints at a share of the way, from 0 to 1 [rad or m].");
  bind_struct<WayResult>(m, "WayResult", "How the joints go from place to place.");
}

void bind_options(py::module_& m) {
  bind_struct<PathLimits>(m, "PathLimits", "Limits of motion from place to place.");
  bind_struct<StopLimits>(m, "StopLimits", "Limits that stop the arm.");
  bind_struct<ScanLine>(m, "ScanLine", "Way of the tool over a place, along which a scanner is moved.");
  bind_struct<JobPlaces>(m, "JobPlaces", "Where things are.");
  bind_struct<TubeStack>(m, "TubeStack", "Pellets that lie on each other in the tube.");
  bind_struct<JobOptions>(m, "JobOptions", "Options of Supervisor.");
}

/// A supervisor with its way to the disk, of one thread: Python knows no cycle that must not wait.
class WritingSupervisor {
 public:
  WritingSupervisor(const JobOptions& options, const RestartDecision& start, Journal& journal)
      : journal_(journal), ring_(numbered(journal)), supervisor_(options, start, *ring_) {}

  kr5::robot::RobotCommand step(const kr5::robot::RobotReading& reading) {
    write_records(*ring_, journal_, problem_);
    const kr5::robot::RobotCommand out = supervisor_.step(reading);
    write_records(*ring_, journal_, problem_);
    return out;
  }
  bool deliver_scan(std::int64_t stamp, const std::vector<PlannedPick>& picks, bool bin_empty, int unreachable) {
    ScanResult result;
    result.stamp = stamp;
    result.bin_empty = bin_empty;
    result.unreachable = unreachable;
    for (const PlannedPick& pick : picks) result.add(pick);
    return supervisor_.deliver(result);
  }
  Supervisor& supervisor() noexcept { return supervisor_; }
  const std::string& problem() const noexcept { return problem_; }

 private:
  static std::unique_ptr<RecordRing> numbered(const Journal& journal) {
    auto out = std::make_unique<RecordRing>();
    out->begin_after(journal.last_number());
    return out;
  }

  Journal& journal_;
  std::unique_ptr<RecordRing> ring_;
  Supervisor supervisor_;
  std::string problem_;
};

void bind_supervisor(py::module_& m) {
  bind_enum<CellFault>(m, "CellFault", "What the check of a cell found.");
  bind_struct<JobState>(m, "JobState", "State of a job.");
  py::class_<WritingSupervisor>(m, "Supervisor",
                                "The job from bin to tube: step it once a cycle, answer what it asks for. Its records "
                                "are in the journal when a step returns; in the cycle of a real controller that is "
                                "done in another thread (kr5/job/journal_writer.hpp).")
      .def(py::init<const JobOptions&, const RestartDecision&, Journal&>(), py::arg("options"), py::arg("start"),
           py::arg("journal"), py::keep_alive<1, 4>())
      .def("step", &WritingSupervisor::step, py::arg("reading"), "Command of this cycle.")
      .def_property_readonly(
          "request", [](WritingSupervisor& self) { return self.supervisor().request(); },
          "What is to be looked at or planned.")
      .def("deliver_scan", &WritingSupervisor::deliver_scan, py::arg("stamp"), py::arg("picks"), py::arg("bin_empty"),
           py::arg("unreachable") = 0,
           "What a scan shows can be picked, the best first, and how many pellets the arm cannot bring to the tube; "
           "False when it was not asked for, or no longer.")
      .def(
          "deliver_hole",
          [](WritingSupervisor& self, const HoleResult& result) { return self.supervisor().deliver(result); },
          py::arg("result"), "Where the tube is; False when it was not asked for, or no longer.")
      .def(
          "deliver_place",
          [](WritingSupervisor& self, const PlaceResult& result) { return self.supervisor().deliver(result); },
          py::arg("result"), "What is at the station or in the tube; False when it was not asked for, or no longer.")
      .def(
          "deliver_way",
          [](WritingSupervisor& self, const WayResult& result) { return self.supervisor().deliver(result); },
          py::arg("result"), "How the joints go (kr5.work.plan_way); False when it was not asked for, or no longer.")
      .def(
          "stop_by_operator", [](WritingSupervisor& self) { self.supervisor().stop_by_operator(); }, "Stops the arm.")
      .def(
          "note_lost_link", [](WritingSupervisor& self) { self.supervisor().note_lost_link(); },
          "Stops the arm, as no reading comes.")
      .def_property_readonly(
          "state", [](WritingSupervisor& self) { return self.supervisor().state(); }, "State of the job.")
      .def_property_readonly(
          "insertion", [](WritingSupervisor& self) { return self.supervisor().insertion(); }, "State of the insertion.")
      .def_property_readonly(
          "finished", [](WritingSupervisor& self) { return self.supervisor().finished(); },
          "Whether nothing moves any more.")
      .def_property_readonly("problem", &WritingSupervisor::problem,
                             "Why the journal could not be written; empty: it could.");
}

void bind_statistics(py::module_& m) {
  bind_struct<JobSamples>(m, "JobSamples", "What was measured during a job.");
  bind_struct<JobStatisticsOptions>(m, "JobStatisticsOptions", "Options of job_statistics.");
  bind_struct<PhaseTime>(m, "PhaseTime", "Time in a phase.");
  bind_struct<AttemptCount>(m, "AttemptCount", "Success of an attempt to insert.");
  bind_struct<PelletFigures>(m, "PelletFigures", "Figures of a pellet.");
  bind_struct<JobStatistics>(m, "JobStatistics", "Figures of a job.");
  m.def(
      "job_statistics",
      [](const std::vector<JobRecord>& records, const JobSamples& samples, const JobStatisticsOptions& options) {
        return job_statistics(records, samples, options);
      },
      py::arg("records"), py::arg("samples") = JobSamples{}, py::arg("options") = JobStatisticsOptions{},
      "Figures of a job, from its records and what was measured meanwhile.");
}

}  // namespace

void bind_job(py::module_& m) {
  m.doc() = "The job from bin to tube: phases, stop, journal, restart, statistics.";
  bind_phases(m);
  bind_journal(m);
  bind_restart(m);
  bind_perception(m);
  bind_options(m);
  bind_supervisor(m);
  bind_statistics(m);
}
