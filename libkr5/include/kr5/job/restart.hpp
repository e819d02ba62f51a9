// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <kr5/job/belief.hpp>
#include <kr5/job/tube_stack.hpp>
#include <kr5/robot/reading.hpp>

/// @file
/// Where a job that was interrupted goes on: what its journal says, compared with what is measured.

namespace kr5::job {

/// What is measured before anything moves.
struct RestartMeasurements {
  robot::RobotReading reading;
  std::optional<bool> station;
  std::optional<int> tube;

  static void each_field(auto& self, auto&& visit) {
    visit("reading", self.reading, "Reading of the robot; gripped by its status, as force, air or finger width tell.");
    visit("station", self.station, "Whether a pellet is on the station, as a person sees it; empty: nobody said.");
    visit("tube", self.tube, "Number of pellets in the tube, as a person counts them; empty: nobody said.");
  }
};

struct RestartOptions {
  Pose T_base_tube = Pose::Identity();
  Pose T_tool_peg = Pose::Identity();
  double bore = 0.005;  ///< [m]
  bool sees_station = false;
  bool sees_tube = false;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("T_base_tube", self.T_base_tube, "Tube in the base, as it is believed [m].");
    visit("T_tool_peg", self.T_tool_peg, "Pellet in the tool, as it goes into the tube [m].");
    visit("bore", self.bore, "Distance from the axis of the tube within which a pellet below its face is in it [m].");
    visit("sees_station", self.sees_station, "Whether the job can scan the station, where nobody said what is there.");
    visit("sees_tube", self.sees_tube, "The same of the tube.");
  }
};

enum class RestartStatus {
  Fresh,          ///< Nothing has been done yet.
  Continue,       ///< From the phase that is stated.
  Look,           ///< The same once a scan has shown where the pellet is (Phase::Look).
  Finished,       ///< Nothing is left to do.
  Latched,        ///< Stopped, until a person has released the stop.
  Unseen,         ///< Something must be measured first.
  Contradiction,  ///< What is measured cannot be: a person must look.
};
constexpr auto enum_names(RestartStatus) {
  using enum RestartStatus;
  return names<RestartStatus>({{Fresh, "fresh"},
                               {Continue, "continue"},
                               {Look, "look"},
                               {Finished, "finished"},
                               {Latched, "latched"},
                               {Unseen, "unseen"},
                               {Contradiction, "contradiction"}});
}

/// Whether a job begins, or goes on, by such a decision.
constexpr bool goes_on(RestartStatus status) noexcept {
  return status == RestartStatus::Fresh || status == RestartStatus::Continue || status == RestartStatus::Look;
}

/// What the comparison found.
enum class RestartFinding {
  AsBelieved,
  WasPicked,        ///< The gripper holds the pellet that was to be picked.
  WasStood,         ///< The pellet stands on the station already.
  WasRegripped,     ///< It was taken from there already.
  WasInserted,      ///< It is in the tube already.
  WasDropped,       ///< It is neither held nor where it was to go.
  PoseInvalid,      ///< The robot tells no pose.
  GripUnexpected,   ///< Something is held, and nothing should be.
  StationOccupied,  ///< A pellet is on the station, and none should be.
  TubeCount,        ///< There are more pellets in the tube, or fewer, than can be.
  TubeStuck,        ///< A pellet stands out of the tube, or is stuck in it.
  StationUnseen,
  TubeUnseen,
};
constexpr auto enum_names(RestartFinding) {
  using enum RestartFinding;
  return names<RestartFinding>({{AsBelieved, "as_believed"},
                                {WasPicked, "was_picked"},
                                {WasStood, "was_stood"},
                                {WasRegripped, "was_regripped"},
                                {WasInserted, "was_inserted"},
                                {WasDropped, "was_dropped"},
                                {PoseInvalid, "pose_invalid"},
                                {GripUnexpected, "grip_unexpected"},
                                {StationOccupied, "station_occupied"},
                                {TubeCount, "tube_count"},
                                {TubeStuck, "tube_stuck"},
                                {StationUnseen, "station_unseen"},
                                {TubeUnseen, "tube_unseen"}});
}

struct RestartDecision {
  RestartStatus status = RestartStatus::Fresh;
  RestartFinding finding = RestartFinding::AsBelieved;
  Phase phase = Phase::CheckCell;
  int pellet = 0;
  PelletState pellet_state = PelletState::Waiting;
  int inserted = 0;
  int tried = 0;
  StopReason stop = StopReason::None;
  bool gripped = false;
  StationPlan station;
  Phase interrupted = Phase::CheckCell;
  bool in_bore = false;
  std::optional<bool> station_seen;

  static void each_field(auto& self, auto&& visit) {
    visit("status", self.status, "Whether the job can go on.");
    visit("finding", self.finding, "What the comparison of journal and measurements found.");
    visit("phase", self.phase, "Phase to go on from.");
    visit("pellet", self.pellet, "Number of the pellet in work; 0: none.");
    visit("pellet_state", self.pellet_state, "Where it is, as measured.");
    visit("inserted", self.inserted, "Number of pellets in the tube.");
    visit("tried", self.tried, "Number of pellets that were tried so far.");
    visit("stop", self.stop, "Stop that nobody has released.");
    visit("gripped", self.gripped, "Whether the gripper holds something.");
    visit("station", self.station, "How the pellet in work goes over the station.");
    visit("interrupted", self.interrupted, "Phase that began last by the journal.");
    visit("in_bore", self.in_bore,
          "Whether the tool is where a pellet that it holds would be in the tube, or the pellet was lost there.");
    visit("station_seen", self.station_seen, "Whether a pellet is on the station; empty: not seen yet.");
  }
};

/// Compares and decides. Nothing is done twice, and no pellet is forgotten: what the measurements say of the one in
/// work corrects the journal, where both can be true; where they cannot, a person is asked.
/// @throws InvalidArgument for invalid options.
RestartDecision decide_restart(const JobBelief& belief, const RestartMeasurements& measurements,
                               const RestartOptions& options = {});

/// Decides anew, once the place that a decision to look names has been seen: the station for `StationUnseen`, the tube
/// for `TubeUnseen`. Allocates nothing.
RestartDecision decide_after_look(const RestartDecision& before, const PlaceResult& seen,
                                  const TubeStack& stack) noexcept;

}  // namespace kr5::job
