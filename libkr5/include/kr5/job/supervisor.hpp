// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include <kr5/job/job_options.hpp>
#include <kr5/job/perception.hpp>
#include <kr5/job/record_ring.hpp>
#include <kr5/job/restart.hpp>
#include <kr5/robot/command.hpp>
#include <kr5/robot/reading.hpp>

/// @file
/// The job from bin to tube (Hayat et al. 2022, chapter 6): scan, pick, put upright, regrip, find the tube, insert,
/// next. No clock, disk or camera is inside: whoever owns those calls `step` once a cycle, answers what it asks for,
/// and writes its records.

namespace kr5::job {

/// What is not as it is believed.
enum class CellFault {
  None,
  Numbers,    ///< A reading holds no finite numbers.
  Joints,     ///< Joints are outside their limits, as when degrees are taken for radians, or are not as many.
  Pose,       ///< The robot tells another pose than its joints give: another arm, signs, zeros, tool or base.
  Workspace,  ///< The tool is outside the workspace.
  Loaded,     ///< Something pushes the tool.
  Grip,       ///< The gripper holds something, or nothing, otherwise than believed.
  Station,    ///< A pellet is on the station that should not be.
  Tube,       ///< A pellet stands out of the tube or is stuck in it, or their number cannot be.
};
constexpr auto enum_names(CellFault) {
  using enum CellFault;
  return names<CellFault>({{None, "none"},
                           {Numbers, "numbers"},
                           {Joints, "joints"},
                           {Pose, "pose"},
                           {Workspace, "workspace"},
                           {Loaded, "loaded"},
                           {Grip, "grip"},
                           {Station, "station"},
                           {Tube, "tube"}});
}

struct JobState {
  Phase phase = Phase::CheckCell;
  Outcome outcome = Outcome::None;
  bool recording = false;
  double phase_time = 0.0;  ///< [s]
  int pellet = 0;
  PelletState pellet_state = PelletState::Waiting;
  int attempt = 0;
  int inserted = 0;
  StopReason stop = StopReason::None;
  Phase stopped_in = Phase::CheckCell;
  CellFault cell_fault = CellFault::None;

  static void each_field(auto& self, auto&& visit) {
    visit("phase", self.phase, "Current phase.");
    visit("outcome", self.outcome, "Outcome of the last phase.");
    visit("recording", self.recording, "True while the arm stands until a record is on the disk.");
    visit("phase_time", self.phase_time, "Time since the phase began [s].");
    visit("pellet", self.pellet, "Number of the pellet in work, from 1; 0: none.");
    visit("pellet_state", self.pellet_state, "Where it is.");
    visit("attempt", self.attempt, "Number of the attempt in this phase, from 1.");
    visit("inserted", self.inserted, "Number of pellets in the tube.");
    visit("stop", self.stop, "Reason of the stop.");
    visit("stopped_in", self.stopped_in, "Phase in which it arose.");
    visit("cell_fault", self.cell_fault, "What is not as it is believed, where that stopped the job.");
  }
};

/// One job. Everything is allocated by the constructor; `step`, `deliver` and the questions neither allocate nor throw,
/// and are of one thread; `stop_by_operator` and `note_lost_link` are of any. Its first command is the pose that is
/// measured. A phase begins when its record is on the disk; until then the arm stands.
class Supervisor {
 public:
  /// @param start What decide_restart said. @param ring Takes the records; must outlive it.
  /// @throws InvalidArgument as the options, or for a decision by which the job cannot go on.
  Supervisor(const JobOptions& options, const RestartDecision& start, RecordRing& ring);
  ~Supervisor();
  Supervisor(Supervisor&&) noexcept;
  Supervisor& operator=(Supervisor&&) noexcept;

  robot::RobotCommand step(const robot::RobotReading& reading) noexcept;
  /// What is to be looked at or planned now.
  const PerceptionRequest& request() const noexcept;
  /// What was seen or planned; false for what was not asked for, or no longer.
  bool deliver(const ScanResult& result) noexcept;
  bool deliver(const HoleResult& result) noexcept;
  bool deliver(const PlaceResult& result) noexcept;
  bool deliver(const WayResult& result) noexcept;
  void stop_by_operator() noexcept;
  void note_lost_link() noexcept;

  const JobState& state() const noexcept;
  const force::InsertionState& insertion() const noexcept;
  /// Whether nothing moves any more: done or stopped.
  bool finished() const noexcept;

 private:
  struct Machine;
  std::unique_ptr<Machine> machine_;
};

}  // namespace kr5::job
