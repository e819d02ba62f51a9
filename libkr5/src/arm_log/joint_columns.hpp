// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/cell/recording.hpp>
#include <kr5/identification/joint_motion.hpp>

/// @file
/// The columns of an experiment that belong to joints, as identification takes them.

namespace kr5::arm_log {

bool has_column(const cell::Experiment& experiment, const std::string& name);
/// `tau` or `i`, whichever of the loads of the joints an experiment has; empty where it has none.
std::string load_family(const cell::Experiment& experiment);
/// Whether an experiment is a motion on measured positions with loads.
bool on_measured_positions(const cell::Experiment& experiment);
/// Columns family1 ... familyN, rows x joints.
Eigen::MatrixXd joint_columns(const cell::Experiment& experiment, const std::string& family, int joints);
/// Torques of the drives on the joint side, rows x joints, in the columns of a family [N m or N, or A].
Eigen::MatrixXd in_columns(const cell::Cell& cell, const std::string& family, const Eigen::MatrixXd& torques);
/// Torques that the links and the tool of a cell take in the motion of an experiment, without drives and friction.
Eigen::MatrixXd link_loads(const cell::Cell& cell, const cell::Experiment& experiment);

/// The motion of an experiment on measured positions, with its torques on the joint side.
/// @param delay By which the torques were logged later than the positions [s]. Rows whose shifted time lies outside the
/// experiment are left out.
identification::JointMotion motion_of(const cell::Cell& cell, const cell::Experiment& experiment, double delay = 0.0);
/// Motions of experiments one after the other, each of them a run.
identification::JointMotion merged_motion(const cell::Cell& cell, const std::vector<cell::Experiment>& experiments,
                                          double delay = 0.0);

/// "N m", or "N" of a slide.
std::string load_unit(const cell::Cell& cell, int joint);
/// The model's name of a joint (from 0), or "joint 3" where it has none.
std::string joint_name(const cell::Cell& cell, int joint);

}  // namespace kr5::arm_log
