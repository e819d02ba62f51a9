// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>
#include <kr5/robot/joint_vector.hpp>

namespace kr5::job {

/// A way of all joints from rest to rest: from one posture to another along a parabola. Of fixed size.
struct JointWay {
  robot::JointVector begin, end;  ///< [rad or m]
  robot::JointVector bow;         ///< [rad or m]
  double duration = 0.0;          ///< [s]

  /// The joints at a share of the way, from 0 to 1.
  robot::JointVector at(double share) const noexcept {
    return begin + share * (end - begin) + 4 * share * (1 - share) * bow;
  }

  static void each_field(auto& self, auto&& visit) {
    visit("begin", self.begin, "Joints where it begins [rad or m].");
    visit("end", self.end, "Joints where it ends [rad or m].");
    visit("bow", self.bow, "Distance of its middle from the straight line between them [rad or m].");
    visit("duration", self.duration, "Time that it takes, with a quintic profile of its share [s].");
  }
};

}  // namespace kr5::job
