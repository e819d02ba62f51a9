// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/job/tube_stack.hpp>

#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::job {

void TubeStack::validate() const {
  require(depth > 0 && std::isfinite(depth), "depth must be positive [m]");
  require(min_height > 0 && max_height >= min_height && std::isfinite(max_height),
          "max_height must be at least min_height, and that positive [m]");
  require(tolerance >= 0 && std::isfinite(tolerance), "tolerance must not be negative [m]");
}

TubeFinding judge_tube(const PlaceResult& look, int inserted, const TubeStack& tube, bool lost_in_bore) noexcept {
  if (!look.seen) return TubeFinding::Unseen;
  if (look.occupied) return TubeFinding::Stuck;
  const TubeFinding by_loss = lost_in_bore ? TubeFinding::OneMore : TubeFinding::Same;
  if (!look.depth) return by_loss;
  const double filled = tube.depth - *look.depth;
  const auto can_be = [&](int pellets) {
    return filled > pellets * tube.min_height - tube.tolerance && filled < pellets * tube.max_height + tube.tolerance;
  };
  const bool same = can_be(inserted), more = can_be(inserted + 1);
  if (same != more) return more ? TubeFinding::OneMore : TubeFinding::Same;
  return same ? by_loss : TubeFinding::Stuck;
}

}  // namespace kr5::job
