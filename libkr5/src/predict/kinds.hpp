// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>

#include <kr5/predict/given.hpp>

/// @file
/// One function a kind of experiment; those of an arm at rest are in kr5/predict/postures.hpp.

namespace kr5::predict {

class MotionMemory;

Shown motion(const cell::Cell& cell, const Given& given, MotionMemory& memory);
Shown step(const cell::Cell& cell, const Given& given);
Shown press(const cell::Cell& cell, const Given& given);
Shown profile(const cell::Cell& cell, const Given& given);

}  // namespace kr5::predict
