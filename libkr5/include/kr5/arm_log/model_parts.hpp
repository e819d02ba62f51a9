// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/arm_log/log_note.hpp>
#include <kr5/cell/cell.hpp>

/// @file
/// What the diagnosis of a log needs of a model beside what the description of a robot states.

namespace kr5::arm_log {

/// Gives a cell drives and tool, where its description has none, so that rotors, friction and payload can be tried;
/// notes of what was added.
std::vector<LogNote> add_parts_to_try(cell::Cell& cell);

/// The robot of a description in the cell of a recording: noise, sensors, and what else no description states, stay
/// those of the recording.
/// @param states_rotors Whether the description states inertias of rotors, on the side of the joints, as MJCF does.
/// @throws InvalidArgument where it is another robot, by the number of its joints or their names.
cell::Cell described_cell(const cell::Cell& description, const cell::Cell& recorded, bool states_rotors = false);

}  // namespace kr5::arm_log
