// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye/second_pose.hpp"

#include <kr5/fit/pipeline/second_minimum.hpp>

namespace kr5::calibration::hand_eye {
namespace {

constexpr auto claim = "two poses of the camera explain the ";

}  // namespace

void judge_second(const fit::pipeline::Rival<RobustStart>& rival, double dof, const std::string& data,
                  HandEyeResult& out) {
  out.second = fit::pipeline::second_minimum(out.T_mount_camera, rival.at.poses.X, rival.best_cost, rival.cost, dof);
  fit::pipeline::refuse_undecided(out.second, claim + data, "take more, from more directions", out.fit);
}

bool only_undecided(const HandEyeResult& result) {
  return result.second && !result.fit.usable() && result.fit.message.starts_with(claim);
}

}  // namespace kr5::calibration::hand_eye
