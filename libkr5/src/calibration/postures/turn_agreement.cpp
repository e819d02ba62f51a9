// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/turn_agreement.hpp>

#include <cmath>
#include <string>
#include <vector>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>

namespace kr5::calibration {
namespace {

double flange_turn(const Pose& a, const Pose& b) { return log_rotation(a.linear().transpose() * b.linear()).norm(); }

}  // namespace

TurnAgreement compare_turns(const kinematics::DhChain& arm, const kinematics::Rows& q, std::span<const Pose> poses,
                            double limit) {
  require(limit > 0, "limit must be positive [rad]");
  require(static_cast<std::size_t>(q.rows()) == poses.size(),
          "found " + std::to_string(q.rows()) + " rows of joint values and " + std::to_string(poses.size()) +
              " poses, expected as many");
  require(q.allFinite(), "joint values must be finite [rad or m]");
  std::vector<double> off;
  Pose before = Pose::Identity();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    require(poses[i].matrix().allFinite(), "poses must be finite");
    const Pose T = arm.flange(q.row(static_cast<Eigen::Index>(i)).transpose());
    if (i > 0) off.push_back(std::abs(flange_turn(before, T) - flange_turn(poses[i - 1], poses[i])));
    before = T;
  }
  TurnAgreement out;
  out.turns = static_cast<int>(off.size());
  out.difference = midpoint_median(off);
  out.agrees = out.difference <= limit;
  return out;
}

}  // namespace kr5::calibration
