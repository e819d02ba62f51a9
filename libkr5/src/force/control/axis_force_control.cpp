// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/axis_force_control.hpp>

#include <kr5/core/error.hpp>

namespace kr5::force {

void AxisForceOptions::validate() const {
  loop.validate();
  require(axis.allFinite() && axis.norm() > 1e-9, "axis: must be finite, and no zero vector");
}

AxisForceControl::AxisForceControl(const AxisForceOptions& options)
    : options_((options.validate(), options)), loop_(options.loop) {}

void AxisForceControl::reset() noexcept {
  loop_.reset();
  begun_ = false;
}

double AxisForceControl::measured(const robot::RobotReading& reading) const noexcept {
  return -axis_.dot(reading.wrench.head<3>());  // the contact pushes back
}

robot::RobotCommand AxisForceControl::step(const robot::RobotReading& reading, double reference) noexcept {
  if (!begun_) {
    if (!reading.T_base_tool.matrix().allFinite()) return {};
    begun_ = true;
    T_base_start_ = reading.T_base_tool;
    axis_ = options_.axis.normalized();
    if (options_.frame == robot::CommandFrame::Tool) axis_ = T_base_start_.linear() * axis_;
  }
  const double correction = loop_.step(reference, measured(reading));
  Pose moved = Pose::Identity();
  if (options_.loop.correction == CorrectionReference::Actual) {
    moved.translation() = correction * axis_;
    return robot::tool_motion(moved, robot::CommandFrame::Base);
  }
  moved = T_base_start_;
  moved.translation() += correction * axis_;
  return robot::tool_command(moved);
}

}  // namespace kr5::force
