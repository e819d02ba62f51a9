// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include <kr5/cell/cell.hpp>
#include <kr5/geometry/pose.hpp>

namespace kr5::sim {

/// The tool on a slide that stands for the arm: it moves along one axis, pointing down, behind the force sensor.
class HeldTool {
 public:
  /// @param T_base_slide Origin and (along its Z) direction of the slide. Needs a tool, whose mass must be positive.
  HeldTool(const cell::Cell& cell, const Pose& T_base_slide);
  ~HeldTool();
  HeldTool(const HeldTool&) = delete;
  HeldTool& operator=(const HeldTool&) = delete;

  double mass() const;
  void place(double z, double speed);
  double z() const;
  double speed() const;
  /// Force of the environment on the tool at the origin of S, in B [N].
  void touch(const Eigen::Vector3d& force);
  /// One step under a force along the slide besides what carries the weight [N].
  void push(double force, double step);
  /// What the sensor feels when the slide stands still, or moves with the acceleration of the last `push`.
  Vector6 wrench_at_rest();
  Vector6 wrench() const;

 private:
  struct Body;
  std::unique_ptr<Body> body_;
};

}  // namespace kr5::sim
