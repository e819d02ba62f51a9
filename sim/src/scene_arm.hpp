// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/sim/scene.hpp>

namespace kr5::sim {

/// A scene with the whole arm: fills rows, steps, pictures and profiles of the result.
void run_arm_scene(const Scene& scene, const cell::Cell& cell, SceneResult& out);

}  // namespace kr5::sim
