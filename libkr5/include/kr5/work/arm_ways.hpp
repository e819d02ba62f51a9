// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/job/perception.hpp>
#include <kr5/work/work_options.hpp>

/// @file
/// Ways of an arm from place to place in its joints. Straight ways of the tool, planned one by one, turn the wrist on
/// and on until it comes to the end of its range; here the postures at all places of a cycle are chosen together.

namespace kr5::work {

/// A place at which a way ends and the next one begins.
struct ArmStop {
  Pose T_base_over = Pose::Identity();
  std::vector<Pose> near;
  bool neutral = false;

  static void each_field(auto& self, auto&& visit) {
    visit("T_base_over", self.T_base_over, "Tool where the ways end and begin [m].");
    visit("near", self.near, "Poses to each of which the tool goes straight from there, and back [m].");
    visit("neutral", self.neutral, "Whether no joint may have made a turn there.");
  }
};

/// Ways through some places.
struct WayPlan {
  int unreachable = -1;
  std::vector<job::JointWay> ways;
  double duration = 0.0;  ///< [s]

  bool possible() const noexcept { return unreachable < 0; }

  static void each_field(auto& self, auto&& visit) {
    visit("unreachable", self.unreachable,
          "Number of the first place, from 0, that the arm does not come to through those before; -1: none.");
    visit("ways", self.ways, "One way to each place; none where a place is unreachable.");
    visit("duration", self.duration, "Sum of their times [s].");
  }
};

/// The postures at the places and the full turns of the joints by which the ways take the least time. Joints stay
/// within their limits with `ways.margin`, on the ways and at every pose near a place; the tool neither sags nor swings
/// between two places. Its speed and acceleration are those of `job.motion`.
/// @param believed Arm, as the controller knows it. @param joints Where the first way begins [rad or m].
/// @throws InvalidArgument for joints that are not as many as those of the arm, or invalid options.
WayPlan plan_ways(const cell::Cell& believed, const Eigen::VectorXd& joints, std::span<const ArmStop> stops,
                  const WorkOptions& options);

/// Where the tool goes from the end of a way until the pellet is in the tube: that end is the first place, the
/// beginning of a scan the last one.
std::vector<ArmStop> stops_ahead(const job::WayRequest& asked, const WorkOptions& options);

/// The way that a supervisor asks for. @param joints Of the arm as it lifts off [rad or m].
/// @throws InvalidArgument as plan_ways.
job::WayResult plan_way(const job::PerceptionRequest& asked, const cell::Cell& believed, const Eigen::VectorXd& joints,
                        const WorkOptions& options);

}  // namespace kr5::work
