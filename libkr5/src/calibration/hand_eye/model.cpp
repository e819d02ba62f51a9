// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye/model.hpp"

namespace kr5::calibration::hand_eye {

Pose predict(Mount mount, const Poses& poses, const Pose& T_base_flange) {
  const Pose T = mount == Mount::EyeInHand ? T_base_flange.inverse() : T_base_flange;
  return poses.X.inverse() * T * poses.Z;
}

Pose robot_pose(Mount mount, const Poses& poses, const Pose& M) {
  const Pose T = poses.Z * M.inverse() * poses.X.inverse();
  return mount == Mount::EyeInHand ? T : Pose(T.inverse());
}

}  // namespace kr5::calibration::hand_eye
