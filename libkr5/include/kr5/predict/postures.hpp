// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include <kr5/cell/cell.hpp>
#include <kr5/predict/given.hpp>

/// @file
/// What is seen of an arm at rest, whichever simulator says where its flange is.

namespace kr5::predict {

/// T_B_F of the arm at rest with joint readings q at time t [s] of the session.
using FlangeAt = std::function<Pose(const Eigen::VectorXd& q, double t)>;

/// The kinds `poses`, `views` and `scan`: the effects on tool, camera and scanner act, those on the arm are `flange`'s.
/// It is asked again only when the posture changes.
Shown poses(const cell::Cell& cell, const Given& given, const FlangeAt& flange);
Shown views(const cell::Cell& cell, const Given& given, const FlangeAt& flange);
Shown scan(const cell::Cell& cell, const Given& given, const FlangeAt& flange);

}  // namespace kr5::predict
