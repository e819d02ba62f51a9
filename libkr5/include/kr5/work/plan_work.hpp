// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/geometry/image_view.hpp>
#include <kr5/job/perception.hpp>
#include <kr5/picking/cloud.hpp>
#include <kr5/work/work_options.hpp>

/// @file
/// What a supervisor asks for, from clouds and pictures (Hayat et al. 2022, sections 6.2 and 6.3).

namespace kr5::work {

/// Picks of a cloud of the bin, the best first, each with its way over the stand, turned there as the arm is quickest.
/// Those that the arm cannot bring into the tube are left out and counted. @param believed Arm, as the controller knows
/// it.
/// @throws InvalidArgument for an invalid cloud or options.
job::ScanResult plan_work(const picking::Cloud& cloud, const cell::Cell& believed, const WorkOptions& options);

/// The tube in a picture, where its face is believed to lie. @param T_base_flange Flange when the picture was taken.
/// @throws InvalidArgument for an empty picture, a cell without camera, or invalid options.
job::HoleResult find_tube(ImageView picture, const cell::Cell& believed, const Pose& T_base_flange,
                          const WorkOptions& options);

}  // namespace kr5::work
