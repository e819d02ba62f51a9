// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/picking/bin.hpp>
#include <kr5/picking/cloud.hpp>

namespace kr5::picking {

/// Origins for the rays of a cloud that names none. Every point was seen, so none may lie behind others: among rays
/// that come from a place, from a line (a scanner that moves) or from far away, those are taken under which the fewest
/// points would be hidden. @param spacing Distance to which the cloud may be thinned for that [m]. @param step
/// Difference of heights beyond which one point hides another [m].
Eigen::Matrix3Xd estimated_origins(const Cloud& cloud, const Bin& bin, double spacing, double step);

}  // namespace kr5::picking
