// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <kr5/cell/columns.hpp>
#include <kr5/gap/diagnosis.hpp>

/// @file
/// Names of what a diagnosis speaks of, as they stand in a sentence. @see sentences.hpp

namespace kr5::gap {

/// `motion` is free motion.
std::string kind_text(cell::Kind kind);
/// What experiments of a kind show of a cell.
std::string shown_by(cell::Kind kind);
/// The name of a kind, and a column of it, apart: `motion.i3`.
std::pair<std::string, std::string> split_group(const std::string& group);
/// `motion.i3` is the current of joint 3.
std::string column_text(const std::string& group);
/// A variable that the residual of a column depends on, in a kind of experiment.
std::string variable_text(const Variable& variable, const std::string& kind = "");
/// Part of the cell that a column belongs to: `joint1`, ..., `sensor`, `tool`, ...
std::string part_of(const std::string& group);
std::string part_text(const std::string& part);
/// What an effect sits on: joint 3, force sensor.
std::string target_text(const std::string& target);
/// Stribeck friction of joint 3.
std::string effect_text(const EffectName& name);
/// An effect on several targets: viscous friction of joints 1, 2 and 3.
std::string effects_text(const std::string& effect, const std::vector<std::string>& targets);
/// Factor from SI, and unit, for people. `N or N.m`, `N/s or N m/s`: of a force or a torque, as the target says; a
/// factor between both has no unit.
std::pair<double, std::string> display_unit(const std::string& unit, const std::vector<double>& values,
                                            const std::string& target);
/// Value with uncertainty and unit; of a pose the uncertainty alone.
std::string value_text(const ParameterEstimate& parameter, const std::string& target);
/// Name that a joint has in the description of the robot, where it says more than its number; else empty, as for any
/// other target.
std::string joint_name(const std::vector<std::string>& joint_names, const std::string& target);
/// Columns of a clock: joint torques, wrench of contact.
std::string clock_text(const ClockFault& fault);

}  // namespace kr5::gap
