// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <kr5/arm_log/diagnose_log.hpp>
#include <kr5/gap/joint_fit.hpp>

/// @file
/// Torque servos of all joints with friction and inertia of what they move, from commands and measured positions.

namespace kr5::arm_log {

/// Ids of the effects that are fitted: stiffness and damping of the servos, dry friction, delay of the commands and
/// inertia of the rotors. Viscous friction acts as damping does, from which positions do not distinguish it. Beside
/// them friction that grows with the load, drag and dead band of a servo are found where they act beyond doubt.
const std::vector<std::string>& servo_effects();

/// Standard deviations by which an effect departs from the model beyond doubt.
constexpr double surely_different = 3.0;

/// Whether the motions of a recording are commands to torque servos with measured positions beside them.
bool moves_by_torque_servos(const cell::Recording& recording);

/// What identify_servos() found of a log.
struct ServoFit {
  gap::JointFit fit;
  cell::Recording recording;  ///< Experiments of the log; its cell is the model.
  std::vector<LogNote> notes;
  std::vector<LogProblem> problems;  ///< What speaks against the log, where it was trusted nevertheless.
};

struct ServoFitOptions {
  bool trust = false;  ///< Whether numbers that are implausible (log_problem.hpp) are used nevertheless.
  int threads = 0;
  std::function<void(double fraction)> progress;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("trust", self.trust, "Whether numbers that are implausible are used nevertheless.");
    visit("threads", self.threads, "Number of threads; 0: one for each core.");
  }
};

/// Fits servos, dry friction and inertias of all joints to a recording, by forward simulation of its commands
/// (gap::fit_joint_effects). Values of its cell are no more than where a search begins.
/// @throws InvalidArgument unless the recording moves by torque servos, which its cell states.
gap::JointFit identify_servos(const cell::Recording& recording, const ServoFitOptions& options = {});

/// The same from the log of an arm: 70 % of the motion is fitted, the rest judges.
/// @throws InvalidArgument as record_log, and for a log without commands or a model without torque servos.
ServoFit identify_servos(const ArmLog& log, const cell::Cell& model, const ServoFitOptions& options = {});

}  // namespace kr5::arm_log
