// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/physics/wrench_sensor.hpp>

/// @file
/// Identified values into a cell. An effect that would replace such a value goes, so that the laws give it.

namespace kr5::physics {

/// Servo of the path correction. @param cycle Of the controller, for a cell that states none [s].
void set_path_servo(cell::Cell& cell, const cell::SecondOrder& servo, double cycle);

/// Servo of a joint, from 0; the others keep theirs, effects included, or get the same when they have none.
/// @throws InvalidArgument when there is no such joint.
void set_joint_servo(cell::Cell& cell, int joint, const cell::SecondOrder& servo, double cycle);

/// Spring of the gear of a joint, from 0: stiffness [N m/rad or N/m] and play [rad or m]; the others keep theirs.
/// @throws InvalidArgument when there is no such joint.
void set_joint_spring(cell::Cell& cell, int joint, double stiffness, double gap);

/// Stiffness [N/m] of the contact and of all in series with it.
void set_contact_stiffness(cell::Cell& cell, double stiffness);

/// Mass [kg] and centre in S [m] of all below the sensor, a payload included.
void set_tool_mass(cell::Cell& cell, double mass, const Eigen::Vector3d& com);

/// Bias, drift, gain and crosstalk of the sensor. A cell holds one source of crosstalk a component: the strongest.
void set_wrench_sensor(cell::Cell& cell, const WrenchSensor& sensor);

}  // namespace kr5::physics
