// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/job/job_options.hpp>
#include <kr5/job/restart.hpp>
#include <kr5/picking/grasp.hpp>
#include <kr5/picking/pellets.hpp>
#include <kr5/picking/placing.hpp>
#include <kr5/sim/work_cell.hpp>

namespace kr5::work {

/// How the ways from place to place are planned in the joints of the arm.
struct ArmWayOptions {
  double joint_speed = 2.0;  ///< [rad/s or m/s]
  double wrist_speed = 4.5;  ///< [rad/s]
  double margin = 0.2;       ///< [rad or m]
  double sag = 0.005;        ///< [m]
  double swing = 0.35;       ///< [rad]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("joint_speed", self.joint_speed,
          "Maximum speed of each joint but the last three; limits of the cell hold, too [rad/s or m/s].");
    visit("wrist_speed", self.wrist_speed, "The same of the last three [rad/s].");
    visit("margin", self.margin, "Distance of every joint from its limits [rad or m].");
    visit("sag", self.sag, "Maximum distance of the tool below the straight line between two places [m].");
    visit("swing", self.swing, "Maximum angle of the tool from the direction between those at two places [rad].");
  }
};

/// What a job in a cell is done with: how it is supervised, and how clouds and pictures are read.
struct WorkOptions {
  job::JobOptions job;
  ArmWayOptions ways;
  picking::Bin bin;
  picking::PelletOptions pellets;
  picking::GraspOptions grasp;
  picking::RegripOptions regrip;
  Pose T_base_lying_seat = Pose::Identity();
  Pose T_base_standing_seat = Pose::Identity();
  double grip_height = 0.012;  ///< [m]
  double hole_search = 0.012;  ///< [m]
  double face_std = 3e-4;      ///< [m]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("job", self.job, "Supervision.");
    visit("ways", self.ways, "How ways from place to place are planned.");
    visit("bin", self.bin, "Bin, as it is believed.");
    visit("pellets", self.pellets, "How pellets are found in a cloud.");
    visit("grasp", self.grasp, "How picks are planned.");
    visit("regrip", self.regrip, "How pellets are stood up on the stand.");
    visit("T_base_lying_seat", self.T_base_lying_seat, "Seat on the stand where a pellet is laid down [m].");
    visit("T_base_standing_seat", self.T_base_standing_seat, "Seat on the stand where a pellet stands [m].");
    visit("grip_height", self.grip_height, "Height of the fingers above the lower end of a standing pellet [m].");
    visit("hole_search", self.hole_search,
          "Half side of the square about its believed place in which the tube is looked for [m].");
    visit("face_std", self.face_std, "Standard deviation of the believed height of the face of the tube [m].");
  }
};

/// Options for a simulated cell, from what its controller is told of it.
/// @throws InvalidArgument naming what the cell lacks.
WorkOptions work_options(const sim::WorkCell& cell);

/// Options of decide_restart that agree with those of the job.
job::RestartOptions restart_options(const WorkOptions& options);

}  // namespace kr5::work
