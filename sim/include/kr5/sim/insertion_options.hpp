// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/force/insertion_options.hpp>
#include <kr5/sim/insertion.hpp>

namespace kr5::sim {

/// Options of force::Insertion for a cell: bodies, servo and grip as the cell states them, the random errors of
/// them as the setup draws it. An arm whose path corrections are limited (servo.correction.per_cycle) is moved within
/// what they can, more slowly.
/// @throws InvalidArgument naming what is not there: tool, contact, peg, tube, servo; or a limit of servo.correction
/// within which no insertion fits, with the least that will do.
force::InsertionOptions insertion_options(const cell::Cell& cell, const InsertionSetup& setup);

}  // namespace kr5::sim
