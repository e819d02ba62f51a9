// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/predict/experiment_input.hpp>
#include <kr5/predict/prediction_table.hpp>

/// @file
/// The kinds of experiment in which something moves, in closed form; those of an arm at rest are in
/// kr5/predict/static_kinds.hpp.

namespace kr5::predict {

class MotionCache;

PredictionTable predict_motion(const cell::Cell& cell, const ExperimentInput& input, MotionCache& cache);
PredictionTable predict_step(const cell::Cell& cell, const ExperimentInput& input);
PredictionTable predict_press(const cell::Cell& cell, const ExperimentInput& input);
PredictionTable predict_profile(const cell::Cell& cell, const ExperimentInput& input);

}  // namespace kr5::predict
