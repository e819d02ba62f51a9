// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include <kr5/kinematics/inverse.hpp>
#include <kr5/work/arm_ways.hpp>

namespace kr5::work {

/// The postures of an arm at places of its tool, with all turns that the limits of its joints leave.
class ArmPostures {
 public:
  /// @param margin To the limits [rad or m].
  ArmPostures(const cell::Cell& believed, double margin);

  Pose tool(const Eigen::VectorXd& q) const { return chain_.flange(q) * T_flange_tool_; }
  /// Those that lead straight to every pose near a place.
  std::vector<Eigen::VectorXd> postures(const ArmStop& stop) const;
  /// The posture at a pose that is nearest to another one.
  std::optional<Eigen::VectorXd> posture_near(const Pose& T_base_tool, const Eigen::VectorXd& near) const;
  /// Where the joints come to as the tool goes straight to a pose; none where they would have to jump.
  std::optional<Eigen::VectorXd> followed(const Eigen::VectorXd& from, const Pose& T_base_tool) const;
  /// Whether joints keep the margin, as far as both ends of their way do.
  bool within(const Eigen::VectorXd& q, const Eigen::VectorXd& begin, const Eigen::VectorXd& end) const;

 private:
  void add_turns(const Eigen::VectorXd& q, const Eigen::VectorXd& low, const Eigen::VectorXd& high, bool neutral,
                 std::vector<Eigen::VectorXd>& out) const;

  kinematics::DhChain chain_;
  Pose T_flange_tool_, T_tool_flange_;
  kinematics::InverseOptions options_;
  Eigen::VectorXd lower_, upper_;  ///< With the margin [rad or m].
};

}  // namespace kr5::work
