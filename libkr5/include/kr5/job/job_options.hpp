// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <Eigen/Core>

#include <kr5/force/insertion.hpp>
#include <kr5/job/phase_table.hpp>
#include <kr5/job/stop_latch.hpp>
#include <kr5/job/tool_path.hpp>
#include <kr5/job/tube_stack.hpp>

namespace kr5::job {

/// A way of the tool over a place, along which a scanner is moved.
struct ScanLine {
  Pose T_base_begin = Pose::Identity();
  Pose T_base_end = Pose::Identity();

  static void each_field(auto& self, auto&& visit) {
    visit("T_base_begin", self.T_base_begin, "Tool where it begins [m].");
    visit("T_base_end", self.T_base_end, "Tool where it ends [m].");
  }
};

/// Where things are, and how the arm goes from one to the other.
struct JobPlaces {
  Pose T_base_scan = Pose::Identity();
  Pose T_base_scan_end = Pose::Identity();
  std::optional<Pose> T_base_rescan, T_base_rescan_end;  ///< [m]
  std::optional<ScanLine> station_scan, tube_scan;
  Pose T_base_tube = Pose::Identity();
  Pose T_tool_peg = Pose::Identity();
  double travel_height = 0.2;  ///< [m]
  double approach = 0.01;      ///< [m]
  double overtravel = 0.001;   ///< [m]
  double look_height = 0.03;   ///< [m]
  double near_tube = 0.02;     ///< [m]

  /// The tool at least at the height of travel, moved along a direction that gains height, or else straight up.
  Pose lifted(const Pose& T_base_tool, const Eigen::Vector3d& direction) const noexcept;
  /// The same against the approach of the tool: where it comes from to such a place, and whereto it leaves.
  Pose over(const Pose& T_base_tool) const noexcept { return lifted(T_base_tool, -T_base_tool.linear().col(2)); }
  /// Where the tool holds the pellet over the middle of a tube, to look for it.
  Pose look(const Pose& T_base_tube) const noexcept;

  static void each_field(auto& self, auto&& visit) {
    visit("T_base_scan", self.T_base_scan, "Tool where the scan of the bin begins [m].");
    visit("T_base_scan_end", self.T_base_scan_end, "Tool where it ends; the same for one that needs no motion [m].");
    visit("T_base_rescan", self.T_base_rescan,
          "Tool where another scan begins, after one that shows nothing to pick: from where that is seen which was "
          "hidden; empty: as the first [m].");
    visit("T_base_rescan_end", self.T_base_rescan_end, "Tool where that scan ends [m].");
    visit("station_scan", self.station_scan,
          "Way over the station, to see whether a pellet is there; empty: a person must say it.");
    visit("tube_scan", self.tube_scan, "Way over the tube, to see what is in it; empty: a person must say it.");
    visit("T_base_tube", self.T_base_tube, "Tube, as it is believed before it is looked for [m].");
    visit("T_tool_peg", self.T_tool_peg,
          "Pellet in the tool once it is regripped: bottom centre, Z along its axis [m].");
    visit("travel_height", self.travel_height,
          "Height in B, clear of everything, at which the tool goes from place to place [m].");
    visit("approach", self.approach, "Distance before a pellet or its seat from which the tool goes slowly [m].");
    visit("overtravel", self.overtravel, "Distance beyond it after which it stops, when nothing is touched [m].");
    visit("look_height", self.look_height, "Height of the pellet over the tube while the tube is looked for [m].");
    visit("near_tube", self.near_tube,
          "Distance from the axis of the tube within which the tool leaves along that axis [m].");
  }
};

struct JobOptions {
  int pellets = 0;
  double cycle = robot::usual_cycle;  ///< [s]
  JobPlaces places;
  TubeStack stack;
  PathLimits motion;
  std::optional<robot::SensorModel> arm;
  StopLimits stop;
  force::InsertionOptions insertion;
  PhaseTable phases = usual_phases();
  double settle_time = 0.5;        ///< [s]
  double settled = 3e-4;           ///< [m]
  double grip_time = 0.3;          ///< [s]
  double record_time = 2.0;        ///< [s]
  double check_time = 0.1;         ///< [s]
  double check_force = 10.0;       ///< [N]
  double pose_mismatch = 0.02;     ///< [m]
  double hole_moved = 0.001;       ///< [m]
  Eigen::VectorXd lowest_joints;   ///< [rad or m]
  Eigen::VectorXd highest_joints;  ///< [rad or m]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("pellets", self.pellets, "Number of pellets to insert; 0: until the bin is empty.");
    visit("cycle", self.cycle, "Time between two readings [s].");
    visit("places", self.places, "Where things are.");
    visit("stack", self.stack, "Pellets in the tube.");
    visit("motion", self.motion, "Limits of motion.");
    visit("arm", self.arm,
          "Arm whose ways from place to place are planned in its joints, as they are asked for; empty: the tool goes "
          "straight.");
    visit("stop", self.stop, "Limits that stop the arm.");
    visit("insertion", self.insertion, "Options of the insertion; its attempts are the retries of the phase search.");
    visit("phases", self.phases, "State machine.");
    visit("settle_time", self.settle_time, "Longest time given to the arm to come to where it was sent [s].");
    visit("settled", self.settled, "Distance from there within which it counts as come [m].");
    visit("grip_time", self.grip_time, "Time given to the gripper to hold, or to let go [s].");
    visit("record_time", self.record_time, "Time given to a record to be on the disk [s].");
    visit("check_time", self.check_time, "Duration of the check of the cell [s].");
    visit("check_force", self.check_force, "Maximum force on the tool while the cell is checked [N].");
    visit("pose_mismatch", self.pose_mismatch,
          "Maximum distance of the tool as the robot tells it from where its joints put it; of an arm with calibrated "
          "joints a few millimetres [m].");
    visit("hole_moved", self.hole_moved, "Correction of the tube's place from which it is looked for again [m].");
    visit("lowest_joints", self.lowest_joints, "Lower limits of the joints; empty: not checked [rad or m].");
    visit("highest_joints", self.highest_joints, "Upper limits of the joints; empty: not checked [rad or m].");
  }
};

}  // namespace kr5::job
