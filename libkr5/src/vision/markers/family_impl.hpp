// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include <apriltag/apriltag.h>
#include <opencv2/aruco.hpp>

namespace kr5::vision {

/// An AprilTag family that frees itself.
using FamilyPointer = std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)>;

bool is_apriltag(const std::string& family);
/// @throws InvalidArgument for another family.
FamilyPointer apriltag_family_of(const std::string& family);
cv::Ptr<cv::aruco::Dictionary> aruco_dictionary_of(const std::string& family);

}  // namespace kr5::vision
