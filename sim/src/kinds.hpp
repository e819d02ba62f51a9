// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/sim/dart_simulator.hpp>

#include <kr5/predict/given.hpp>

/// @file
/// One function a kind of experiment that is stepped through time.

namespace kr5::sim {

predict::Shown motion(const cell::Cell& cell, const predict::Given& given, const DartSimulatorOptions& options);
predict::Shown step(const cell::Cell& cell, const predict::Given& given, const DartSimulatorOptions& options);
predict::Shown press(const cell::Cell& cell, const predict::Given& given, const DartSimulatorOptions& options);
predict::Shown profile(const cell::Cell& cell, const predict::Given& given, const DartSimulatorOptions& options);

}  // namespace kr5::sim
