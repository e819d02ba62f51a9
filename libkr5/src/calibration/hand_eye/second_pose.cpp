// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye/second_pose.hpp"

#include <kr5/fit/pipeline/second_minimum.hpp>

namespace kr5::calibration::hand_eye {

void judge_second(const fit::pipeline::Rival<RobustStart>& rival, double dof, const std::string& data,
                  HandEyeResult& out) {
  out.second = fit::pipeline::second_minimum(out.T_mount_camera, rival.at.poses.X, rival.best_cost, rival.cost, dof);
  fit::pipeline::refuse_undecided(out.second, "two poses of the camera explain the " + data,
                                  "take more, from more directions", out.fit);
}

}  // namespace kr5::calibration::hand_eye
