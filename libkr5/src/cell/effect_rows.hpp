// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/effect.hpp>

/// @file
/// The rows of the catalogue by subsystem, and the names of targets.

namespace kr5::cell {

std::vector<Effect> drive_rows();
std::vector<Effect> servo_rows();
std::vector<Effect> arm_rows();
std::vector<Effect> sensor_rows();
std::vector<Effect> task_rows();

/// All rows, also those that were registered; they stay where they are.
const std::deque<Effect>& effect_rows();
/// The row with what follows from the rest of it: which parameters replace a nominal value, and what else is off at 0.
Effect completed(Effect row);
void add_row(Effect row);
void remove_row(const std::string& id);

/// The row of an effect, or null.
const Effect* find_row(std::string_view id);
/// @throws InvalidArgument naming the nearest effect.
const Effect& required_row(std::string_view id);
/// @throws InvalidArgument naming the parameters that the effect has.
const EffectParameter& required_parameter(const Effect& row, std::string_view parameter);
/// @throws InvalidArgument naming the targets that the effect has.
int required_index(const Effect& row, const std::string& target);

/// Active effects of rows that were registered.
std::vector<ActiveEffect> registered_active_effects(const Effects& effects);

/// Index of a target such as `joint3` (2), `fx` (0) or `camera` (0) for an effect of this kind; -1 when it is none.
int target_index(EffectTarget kind, const std::string& target);
std::string target_name(EffectTarget kind, int index);
/// `joint1, joint2, ...`, `fx | fy | ...`, `camera`: for messages.
std::string target_text(EffectTarget kind);
/// How many targets of a kind a cell has that has any.
int target_count(EffectTarget kind, const Cell& cell);

}  // namespace kr5::cell
