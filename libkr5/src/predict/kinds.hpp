// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>

#include "predict/given.hpp"

/// @file
/// One function a kind of experiment.

namespace kr5::predict {

Shown motion(const cell::Cell& cell, const Given& given);
Shown poses(const cell::Cell& cell, const Given& given);
Shown views(const cell::Cell& cell, const Given& given);
Shown scan(const cell::Cell& cell, const Given& given);
Shown step(const cell::Cell& cell, const Given& given);
Shown press(const cell::Cell& cell, const Given& given);
Shown profile(const cell::Cell& cell, const Given& given);

}  // namespace kr5::predict
