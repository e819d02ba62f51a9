// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include <kr5/job/supervisor.hpp>

namespace kr5::job {

/// The state machine of a job. What a phase does is a function that gives an outcome, or none while it goes on; what
/// follows an outcome stands in the table alone.
struct Supervisor::Machine {
  Machine(const JobOptions& given, const RestartDecision& decision, RecordRing& given_ring);

  robot::RobotCommand step(const robot::RobotReading& reading) noexcept;

  // Transitions and records (machine.cpp).
  void take(const RestartDecision& decision) noexcept;
  void begin(const robot::RobotReading& reading) noexcept;
  robot::RobotCommand hold_stopped(const robot::RobotReading& reading) noexcept;
  Outcome run_phase(const robot::RobotReading& reading) noexcept;
  void leave_phase(Outcome outcome) noexcept;
  bool take_retry(const PhaseExit& exit) noexcept;
  void prepare_pellet(Outcome outcome, Phase next) noexcept;
  void enter_phase() noexcept;
  void write(RecordKind kind, Phase phase) noexcept;
  void wait_for_record() noexcept;
  const PhaseRow& row() const noexcept { return options.phases.row(state.phase); }
  double seconds(int cycles) const noexcept { return cycles * options.cycle; }

  // Ways from place to place (travel.cpp).
  void lift() noexcept;
  void travel_to(const Pose& T_base_tool, bool known_clear) noexcept;
  void travel_over(const Pose& T_base_tool) noexcept;
  void go_over(const Pose& T_base_over) noexcept;
  Pose look_pose() const noexcept { return options.places.look(T_base_tube); }
  Outcome on_the_way() const noexcept;
  bool sweep(const ScanLine& line, RequestKind asks, const robot::RobotReading& reading) noexcept;
  bool near_tube(const Pose& T_base_tool) const noexcept;

  // What the gripper does (travel.cpp).
  bool lost_pellet(const robot::RobotReading& reading) noexcept;
  bool at_station(const Pose& T_base_tool) const noexcept;
  void set_grip(bool hold) noexcept;
  bool grip_is(const robot::RobotReading& reading, bool gripped) noexcept;
  bool follow(const robot::RobotReading& reading) noexcept;

  // Phases (bin_phases.cpp, tube_phases.cpp).
  CellFault find_cell_fault(const robot::RobotReading& reading) const noexcept;
  Outcome check_cell(const robot::RobotReading& reading) noexcept;
  Outcome look(const robot::RobotReading& reading) noexcept;
  Outcome scan_bin(const robot::RobotReading& reading) noexcept;
  Outcome pick(const robot::RobotReading& reading) noexcept;
  Outcome stand(const robot::RobotReading& reading) noexcept;
  Outcome regrip(const robot::RobotReading& reading) noexcept;
  Outcome approach(const robot::RobotReading& reading) noexcept;
  Outcome judge_hole() noexcept;
  Outcome search(const robot::RobotReading& reading) noexcept;
  Outcome insert(const robot::RobotReading& reading) noexcept;
  Outcome next(const robot::RobotReading& reading) noexcept;
  bool release_pellet(const robot::RobotReading& reading) noexcept;
  Outcome look_for_pellet(const robot::RobotReading& reading) noexcept;
  void step_insertion(const robot::RobotReading& reading) noexcept;
  Outcome insertion_end() noexcept;

  JobOptions options;
  RestartDecision start;
  RecordRing& ring;
  StopLatch latch;
  ToolPath path;
  force::Insertion insertion;
  JobState state;
  PerceptionRequest request;
  ScanResult scan;
  HoleResult hole;
  PlaceResult place;

  Pose commanded = Pose::Identity();
  robot::GripperCommand gripper;
  Pose T_base_tube;
  PlannedPick planned;
  bool has_plan = false;  ///< Whether a pick of the scan is left to be tried.
  int visit = 0;          ///< Of the station.
  int next_pick = 0;
  int tried = 0;
  bool hole_felt = false;      ///< A pellet went into the hole where it is believed.
  bool station_known = false;  ///< A pellet was put there as it should be, and none was lost since.
  bool answered = false;       ///< What was asked for has come.
  bool dropping = false;
  bool no_way = false;  ///< There is none to where the arm shall go.

  bool fingers = false;  ///< Hold the pellet, or will.

  bool begun = false;
  bool stop_written = false;
  std::uint64_t awaited = 0;  ///< Number of the record that is waited for; 0: none.
  Phase coming = Phase::CheckCell;
  std::int64_t cycle = 0;
  double time = 0.0;  ///< Of the reading of this cycle [s].
  int phase_cycles = 0, wait_cycles = 0, grip_cycles = 0, grip_seen = 0, unheld = 0, settle_cycles = 0;
  int stage = 0, sweep_stage = 0;
  int insertion_attempt = 1;
  std::array<int, phase_count> retries{};
};

}  // namespace kr5::job
