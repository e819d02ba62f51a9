// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include <kr5/cell/cell.hpp>
#include <kr5/predict/experiment_input.hpp>
#include <kr5/predict/prediction_table.hpp>

/// @file
/// The kinds of experiment in which the arm is at rest, for any simulator that provides the pose of its flange.

namespace kr5::predict {

/// T_base_flange of the arm at rest with joint readings q at time t [s] of the session.
using FlangeAtRest = std::function<Pose(const Eigen::VectorXd& q, double t)>;

/// The kinds `poses`, `views` and `scan`: the effects on tool, camera and scanner act here, those on the arm in
/// `flange`, which is asked again only when the posture changes.
PredictionTable predict_poses(const cell::Cell& cell, const ExperimentInput& input, const FlangeAtRest& flange);
PredictionTable predict_views(const cell::Cell& cell, const ExperimentInput& input, const FlangeAtRest& flange);
PredictionTable predict_scan(const cell::Cell& cell, const ExperimentInput& input, const FlangeAtRest& flange);

}  // namespace kr5::predict
