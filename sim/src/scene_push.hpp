// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/sim/scene.hpp>

namespace kr5::sim {

/// A scene in which the tool alone is pushed at the tube: fills rows and steps of the result.
void run_push_scene(const Scene& scene, const cell::Cell& cell, SceneResult& out);

}  // namespace kr5::sim
