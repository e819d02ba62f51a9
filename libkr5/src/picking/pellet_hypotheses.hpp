// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "pellet_fit.hpp"

namespace kr5::picking {

/// Cylinders that a patch may belong to: a curved one gives axis and radius, and the rays say where along it the ends
/// may be; a flat one is an end face, and the rays say where its rim may be.
std::vector<SolidCylinder> hypotheses(const PelletScene& scene, const Cloud& cloud, const Patch& patch);

}  // namespace kr5::picking
