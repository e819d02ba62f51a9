// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>
#include <kr5/job/perception.hpp>

namespace kr5::job {

/// Pellets that lie on each other in the tube.
struct TubeStack {
  double depth = 0.06;        ///< [m]
  double min_height = 0.014;  ///< [m]
  double max_height = 0.017;  ///< [m]
  double tolerance = 0.002;   ///< [m]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("depth", self.depth, "Depth of the bore below the face [m].");
    visit("min_height", self.min_height, "Minimum height of a pellet [m].");
    visit("max_height", self.max_height, "Maximum height of a pellet [m].");
    visit("tolerance", self.tolerance, "Maximum error of a depth that is seen [m].");
  }
};

/// What a look at the tube says of a pellet that is not in the grip any more.
enum class TubeFinding {
  Unseen,
  Same,     ///< It is not in the tube.
  OneMore,  ///< It is at the bottom, or on the others.
  Stuck,    ///< It stands out of the tube, or is stuck in it.
};
constexpr auto enum_names(TubeFinding) {
  using enum TubeFinding;
  return names<TubeFinding>({{Unseen, "unseen"}, {Same, "same"}, {OneMore, "one_more"}, {Stuck, "stuck"}});
}

/// Where the depth does not tell, since the heights of many pellets are not known that well or the bore is not seen to
/// its ground, it is where it was lost that tells.
/// @param inserted Number of pellets in the tube before. @param lost_in_bore Whether the pellet was in the mouth of
/// the bore when it was lost.
TubeFinding judge_tube(const PlaceResult& look, int inserted, const TubeStack& tube, bool lost_in_bore) noexcept;

}  // namespace kr5::job
