// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

/// @file
/// The markers that can be printed and found: AprilTag families `36h11 25h9 16h5 41h12` and the ArUco dictionaries
/// `aruco_4x4_50 ... aruco_7x7_1000, aruco_original`.

namespace kr5 {

/// Every family by name.
const std::vector<std::string>& marker_families();
/// The name of a family by any that it has elsewhere: tag36h11, tagStandard41h12, DICT_APRILTAG_36h11, DICT_4X4_50.
/// @throws InvalidArgument that lists the families.
std::string marker_family(const std::string& name);
/// Number of different markers of a family. @throws InvalidArgument that lists the families.
int marker_count(const std::string& family);

}  // namespace kr5
