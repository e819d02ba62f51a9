// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/calibration/hand_eye_pairs.hpp>

#include "hand_eye_world.hpp"

/// @file
/// Pairs of poses of a synthetic cell whose true places are known.

namespace kr5::test {

/// Standard deviations per axis; the position noise is half the robot's, half the camera's.
struct PairsNoise {
  double position = 0.0;         ///< [m]
  double robot_rotation = 0.0;   ///< [rad]
  double camera_rotation = 0.0;  ///< [rad]
};

struct PairsWorld {
  Pose T_mount_camera = Pose::Identity();
  Pose T_fixed_target = Pose::Identity();
  std::vector<calibration::PosePair> pairs;
};

/// `axes`: 3: the wrist turns every way; 1: about one axis only; 0: never.
inline PairsWorld make_pairs_world(int count, Mount mount, const PairsNoise& noise, std::uint64_t seed, int axes = 3) {
  const HandEyeWorld w =
      make_hand_eye_world({.mount = mount, .views = count, .sigma_pixel = 0, .axes = axes, .seed = seed});
  Random random(seed + 1'000'000);
  PairsWorld out{w.T_mount_camera, w.T_fixed_target, {}};
  const double position = noise.position / std::sqrt(2.0);
  const auto error = [&](double rotation) {
    Vector6 e;
    e << random.normal_vector(3, position), random.normal_vector(3, rotation);
    return to_pose(e);
  };
  for (int i = 0; i < count; ++i) {
    const Pose& T = w.T_base_flange[static_cast<std::size_t>(i)];
    out.pairs.push_back({"pair" + std::to_string(i), T * error(noise.robot_rotation),
                         target_in_camera(w, mount, T) * error(noise.camera_rotation)});
  }
  return out;
}

}  // namespace kr5::test
