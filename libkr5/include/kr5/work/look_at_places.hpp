// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/job/perception.hpp>
#include <kr5/picking/cloud.hpp>
#include <kr5/work/work_options.hpp>

/// @file
/// What is at the places where a pellet may be, from clouds of them in the base.

namespace kr5::work {

/// Whether a pellet is on the stand. @throws InvalidArgument for invalid options.
job::PlaceResult look_at_stand(const picking::Cloud& cloud, const WorkOptions& options);

/// Whether a pellet stands out of the tube, and how deep its bore is free. @param believed The tube, as the controller
/// knows it.
/// @throws InvalidArgument for invalid options.
job::PlaceResult look_at_tube(const picking::Cloud& cloud, const cell::Cell& believed, const WorkOptions& options);

}  // namespace kr5::work
