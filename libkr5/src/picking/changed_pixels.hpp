// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/picking/disturbance.hpp>

namespace kr5::picking {

/// Distance of each pixel from the nearest one of a mask [px]; infinite when there is none. Exact (Felzenszwalb and
/// Huttenlocher 2012).
Eigen::MatrixXd distance_to(const PixelMask& mask);

/// Connected regions of at least `min_pixels` pixels, which touch by sides or corners, largest first; the pixels of
/// the others are taken out of the mask. @param size_of_change Of each pixel [grey].
std::vector<ChangeRegion> keep_regions(PixelMask& mask, const Eigen::MatrixXd& size_of_change, int min_pixels);

}  // namespace kr5::picking
