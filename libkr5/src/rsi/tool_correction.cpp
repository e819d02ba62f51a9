// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/tool_correction.hpp"

namespace kr5::rsi {

Vector6 tool_correction(const Pose& path, const Pose& corrected, robot::CommandFrame frame) noexcept {
  if (frame == robot::CommandFrame::Tool) return to_vector(path.inverse() * corrected);
  Vector6 out;
  out << corrected.translation() - path.translation(), log_rotation(corrected.linear() * path.linear().transpose());
  return out;
}

}  // namespace kr5::rsi
