// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/job/job_options.hpp>
#include <kr5/job/restart.hpp>
#include <kr5/picking/grasp.hpp>
#include <kr5/picking/pellets.hpp>
#include <kr5/picking/placing.hpp>
#include <kr5/sim/work_cell.hpp>

namespace kr5::work {

/// What a job in a cell is done with: how it is supervised, and how clouds and pictures are read.
struct WorkOptions {
  job::JobOptions job;
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
