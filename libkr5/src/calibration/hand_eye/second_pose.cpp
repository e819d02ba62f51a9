// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye/second_pose.hpp"

#include "calibration/pipeline/second_minimum.hpp"

namespace kr5::calibration::hand_eye {

void judge_second(const pipeline::Rival<RobustStart>& rival, double dof, const std::string& data, HandEyeResult& out) {
  out.second = pipeline::second_minimum(out.T_mount_camera, rival.at.poses.X, rival.best_cost, rival.cost, dof);
  if (!out.second || out.second->probability < pipeline::undecided || !out.fit.usable()) return;
  out.fit.status = FitStatus::Degenerate;
  out.fit.message = "two poses of the camera explain the " + data + ": " + pipeline::second_text(*out.second) +
                    "; take more, from more directions";
}

}  // namespace kr5::calibration::hand_eye
