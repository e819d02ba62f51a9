// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/predict/experiment_input.hpp>
#include <kr5/predict/prediction_table.hpp>
#include <kr5/sim/dart_simulator.hpp>

/// @file
/// The kinds of experiment that are stepped through time, one function each.

namespace kr5::sim {

predict::PredictionTable simulate_motion(const cell::Cell& cell, const predict::ExperimentInput& input,
                                         const DartSimulatorOptions& options);
predict::PredictionTable simulate_step(const cell::Cell& cell, const predict::ExperimentInput& input,
                                       const DartSimulatorOptions& options);
predict::PredictionTable simulate_press(const cell::Cell& cell, const predict::ExperimentInput& input,
                                        const DartSimulatorOptions& options);
predict::PredictionTable simulate_profile(const cell::Cell& cell, const predict::ExperimentInput& input,
                                          const DartSimulatorOptions& options);

}  // namespace kr5::sim
