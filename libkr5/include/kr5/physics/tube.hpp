// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/cell/placed_object.hpp>
#include <kr5/force/peg_tube_contact.hpp>

/// @file
/// Tube and peg as they stand, with the effects on the tube.

namespace kr5::physics {

/// Displacement of the tube in its nominal frame.
Pose tube_shift(const cell::Cell& cell);
/// Tilt of the tube, about X then Y of that frame.
Pose tube_tilt(const cell::Cell& cell);
/// Radius of the bore [m]. Needs a tube.
double tube_radius(const cell::Cell& cell);

/// Actual tube in its nominal frame.
Pose T_tube_actual(const cell::Cell& cell);

/// Moves the actual tube along X Y Z of T [m], and tilts it about X then Y of T [rad], beyond what its effects do.
void shift_tube(cell::Cell& cell, const Eigen::Vector3d& by);
void tilt_tube(cell::Cell& cell, const Eigen::Vector2d& by);
/// Widens the bore, where an effect replaces that of the cell [m].
void widen_tube(cell::Cell& cell, double by);
/// Dimensions of peg and tube. Needs both.
force::PegTubeShape peg_tube_shape(const cell::Cell& cell);
/// Actual tube in the base, for rays of camera and scanner. Needs a tube.
cell::PlacedObject tube_object(const cell::Cell& cell);

}  // namespace kr5::physics
