// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/insertion.hpp>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include <kr5/core/error.hpp>

#include "force/insertion/machine.hpp"

namespace kr5::force {
namespace {

/// Every number of a part by its name. @param zero These may be 0. @param infinite Whether they may be infinite.
void check_numbers(const auto& part, const std::string& name, std::initializer_list<std::string_view> zero,
                   bool infinite = false) {
  constexpr double greatest = 1e9;  // what is more is no stiffness, limit or time of a cell
  std::remove_cvref_t<decltype(part)>::each_field(part, [&](const char* field, const auto& value, const char*) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, double>) {
      const bool may_be_zero = std::find(zero.begin(), zero.end(), field) != zero.end();
      require(infinite ? !std::isnan(value) : std::isfinite(value), name + "." + field + ": must be finite");
      require(value <= greatest || (infinite && std::isinf(value)), name + "." + field + ": must be at most 1e9");
      require(value > 0 || (may_be_zero && value == 0),
              name + "." + field + (may_be_zero ? ": must not be negative" : ": must be positive"));
    }
  });
}

}  // namespace

void InsertionOptions::validate() const {
  bodies.validate();
  require(tilt > 0 && tilt < M_PI_2, "tilt: must lie between 0 and a quarter turn [rad]");
  require(std::isfinite(azimuth), "azimuth: must be finite [rad]");
  require(cycle > 0 && std::isfinite(cycle), "cycle: must be positive [s]");
  require(cutoff > 0 && cutoff < 0.5 / cycle, "cutoff: must lie between 0 and half the rate of the cycles [Hz]");
  require(delay >= 0 && std::isfinite(delay), "delay: must not be negative [s]");
  require(servo_frequency >= 0 && std::isfinite(servo_frequency), "servo_frequency: must not be negative [rad/s]");
  require(servo_damping >= 0 && std::isfinite(servo_damping), "servo_damping: must not be negative");
  require(!hole || hole->allFinite(), "hole: must be finite [m]");
  check_numbers(grip, "grip", {"height", "tilt_uncertainty", "position_uncertainty"}, true);
  check_numbers(forces, "forces", {"angular_gain"});
  check_numbers(motion, "motion", {"clear_height", "spiral_radius"});
  check_numbers(limits, "limits", {"face_error", "travel", "dead_after", "halting"});
  require(0.8 * limits.force > forces.touch, "limits.force: must be more than 1.25 times forces.touch [N]");
  require(0.8 * limits.force > forces.obstacle, "limits.force: must be more than 1.25 times forces.obstacle [N]");
  require((limits.current.array() > 0).all(), "limits.current: every limit must be positive [A]");
  require(limits.attempts >= 1, "limits.attempts: must be at least 1");
  safety_limits(*this).validate();
  guarded_move_options(*this).validate();
}

void InsertionFrames::validate() const {
  for (const auto& [pose, name] : {std::pair{&T_base_tube, "T_base_tube"}, std::pair{&T_tool_peg, "T_tool_peg"}})
    require(pose->matrix().allFinite() && is_rotation(pose->linear()), std::string(name) + ": must be a rigid motion");
}

Pose T_tube_peg(const InsertionFrames& frames, const robot::RobotReading& reading) noexcept {
  return frames.T_base_tube.inverse() * reading.T_base_tool * frames.T_tool_peg;
}

Vector6 wrench_on_peg(const InsertionFrames& frames, const robot::RobotReading& reading) noexcept {
  const Eigen::Matrix3d R_tube_base = frames.T_base_tube.linear().transpose();
  const Eigen::Vector3d force = reading.wrench.head<3>();
  const Eigen::Vector3d peg_to_tool = -(reading.T_base_tool.linear() * frames.T_tool_peg.translation());
  Vector6 out;
  out << R_tube_base * force, R_tube_base * (reading.wrench.tail<3>() + peg_to_tool.cross(force));
  return out;
}

Pose T_base_tool(const InsertionFrames& frames, const Pose& T_tube_peg) noexcept {
  return frames.T_base_tube * T_tube_peg * frames.T_tool_peg.inverse();
}

Insertion::Insertion(const InsertionOptions& options, const InsertionFrames& frames)
    : machine_(std::make_unique<Machine>(options, frames)) {}
Insertion::~Insertion() = default;
Insertion::Insertion(Insertion&&) noexcept = default;
Insertion& Insertion::operator=(Insertion&&) noexcept = default;

robot::RobotCommand Insertion::step(const robot::RobotReading& reading) noexcept { return machine_->step(reading); }
const InsertionState& Insertion::state() const noexcept { return machine_->state; }
bool Insertion::finished() const noexcept {
  return machine_->state.phase == Phase::Done || machine_->state.phase == Phase::Stopped;
}
std::span<const ProfileRow> Insertion::profile() const noexcept { return machine_->turn.rows(); }
void Insertion::restart() noexcept { machine_->restart(); }

}  // namespace kr5::force
