// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/placed_object.hpp>

/// @file
/// DART's own window (OpenSceneGraph). Built only where DART's `gui-osg` is; no module of the library needs it.

namespace kr5::sim {

/// What moves in the window.
struct Motion {
  Eigen::VectorXd t;  ///< Growing [s].
  Eigen::MatrixXd q;  ///< True joint values, a row each time [rad or m].
};

/// Shows the cell moving, again and again, until the window is closed. Links are cylinders between the frames of the
/// nominal arm, as on the page of a replay.
/// @param picture Not empty: one frame in the middle of the motion is saved there (PNG), and the window closes.
/// @throws IoError when there is no display.
void show_window(const cell::Cell& cell, const std::vector<cell::PlacedObject>& objects, const Motion& motion,
                 const std::string& picture = "");

}  // namespace kr5::sim
