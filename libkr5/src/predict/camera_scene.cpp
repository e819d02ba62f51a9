// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/camera_scene.hpp>

#include <kr5/physics/camera.hpp>
#include <kr5/predict/cell_objects.hpp>

namespace kr5::predict {

CameraScene camera_scene(const cell::Cell& cell, const Pose& T_base_flange,
                         const std::vector<cell::PlacedObject>& objects) {
  const physics::EffectiveCamera camera(cell);
  CameraScene out{camera.lens(), camera.T_base_camera(T_base_flange), {}, {}, {}};
  const Pose T_camera_base = out.T_base_camera.inverse();
  for (const cell::Target& target : cell_targets(cell)) {
    if (!target.T_base_target && !target.T_flange_target) continue;
    out.names.push_back(target.name.empty() ? "target" : target.name);
    out.targets.push_back({target, T_camera_base * (target.T_base_target ? *target.T_base_target
                                                                         : T_base_flange * *target.T_flange_target)});
  }
  std::vector<cell::PlacedObject> all = cell_solids(cell);
  all.insert(all.end(), objects.begin(), objects.end());
  for (const cell::PlacedObject& object : all) out.solids.push_back({object, T_camera_base * object.T_base_object});
  return out;
}

}  // namespace kr5::predict
