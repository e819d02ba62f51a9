// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/job/joint_way.hpp>
#include <kr5/robot/sensing.hpp>

/// @file
/// Smooth motion of the tool through a few poses. Cycle by cycle; nothing here allocates or throws once it is made.

namespace kr5::job {

struct PathLimits {
  double speed = 0.5;                  ///< [m/s]
  double acceleration = 2.5;           ///< [m/s^2]
  double turning_speed = 2.0;          ///< [rad/s]
  double turning_acceleration = 10.0;  ///< [rad/s^2]
  double scan_speed = 0.06;            ///< [m/s]
  double contact_speed = 0.02;         ///< [m/s]
  double careful_speed = 0.08;         ///< [m/s]
  double obstacle_force = 8.0;         ///< [N]
  double touch_force = 3.0;            ///< [N]
  double settling = 0.06;              ///< [s]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("speed", self.speed, "Maximum speed of the tool tip [m/s].");
    visit("acceleration", self.acceleration, "Maximum acceleration of the tool tip [m/s^2].");
    visit("turning_speed", self.turning_speed, "Maximum turning speed of the tool [rad/s].");
    visit("turning_acceleration", self.turning_acceleration, "Maximum angular acceleration of the tool [rad/s^2].");
    visit("scan_speed", self.scan_speed, "Maximum speed over the bin while it is scanned [m/s].");
    visit("contact_speed", self.contact_speed, "Maximum speed where something may be touched [m/s].");
    visit("careful_speed", self.careful_speed,
          "Maximum speed where something may stand that is not known, at which the arm can still be stopped before a "
          "force comes to its limit; no more than `speed` [m/s].");
    visit("obstacle_force", self.obstacle_force, "Force during such a motion that ends it [N].");
    visit("touch_force", self.touch_force, "Force against such a motion that ends it [N].");
    visit(
        "settling", self.settling,
        "Time from its beginning until the arm has come to rest before it, and touches can be told from inertia [s].");
  }
};

/// How a way is gone.
enum class Way {
  Free,     ///< As fast as the limits allow.
  Slow,     ///< At the speed of contact.
  Careful,  ///< At the careful speed, steadily, until something is met that should not be there.
  Scan,     ///< At the speed of a scan.
  Guarded,  ///< At the speed of contact, until something is touched.
  Joint,    ///< As the joints of the arm go; the tool stands before it until their way is known.
};

/// Straight from pose to pose, or along a way of the joints; speed and acceleration are zero at each pose. A guarded
/// way ends early when something is touched, a careful one when something is met.
class ToolPath {
 public:
  static constexpr std::size_t capacity = 8;

  /// @param cycle [s]. @param arm Whose joints have ways; none: there are no such ways.
  /// @throws InvalidArgument as its limits, or for a cycle that is not positive.
  ToolPath(const PathLimits& limits, double cycle, const std::optional<robot::SensorModel>& arm = {});

  /// Begins anew, standing at a pose.
  void start(const Pose& T_base_tool) noexcept;
  /// Another pose to go to; those beyond the capacity are left out, and `complete` says so.
  void add(const Pose& T_base_tool, Way way = Way::Free) noexcept;
  bool complete() const noexcept { return complete_; }
  /// How the joints go along the first joint way that is not known. False where there is none, or where it neither
  /// begins nor ends as this one.
  bool set_joint_way(const JointWay& way) noexcept;
  /// Whether it stands before a joint way that is not known.
  bool waiting() const noexcept { return at_ < count_ && segments_[at_].way == Way::Joint && !segments_[at_].known; }

  /// Where the tool shall be in this cycle. @param force Of the environment on the tool, in B [N].
  const Pose& step(const Eigen::Vector3d& force) noexcept;
  /// A cycle of slowing down, along the way.
  const Pose& brake() noexcept;
  /// Whether it stands: at its end, or where it touched, or when it has braked.
  bool standing() const noexcept { return at_ >= count_ && rate_ == 0.0; }
  bool touched() const noexcept { return touched_; }
  /// Whether something was met on a careful way.
  bool obstructed() const noexcept { return obstructed_; }
  const Pose& pose() const noexcept { return pose_; }
  /// Where it goes in the end.
  const Pose& end() const noexcept { return count_ > 0 ? segments_[count_ - 1].to : pose_; }

 private:
  struct Segment {
    Pose from = Pose::Identity(), to = Pose::Identity();
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();  ///< Rotation vector, in axes of `from` [rad].
    double duration = 0.0;                           ///< [s]
    double max_braking = 0.0;                        ///< Of the share [1/s^2].
    Way way = Way::Free;
    bool steady = false;  ///< At one speed between its ends.
    JointWay joints;
    bool known = false;  ///< The way of the joints.
  };
  Pose tool_at(const robot::JointVector& joints) const noexcept;
  double speed_of(Way way) const noexcept;
  void go_to(const Segment& segment, double share) noexcept;
  void feel(const Segment& segment, const Eigen::Vector3d& force) noexcept;

  PathLimits limits_;
  double cycle_;
  std::optional<robot::SensorModel> arm_;
  std::array<Segment, capacity> segments_;
  std::size_t count_ = 0, at_ = 0;
  Pose pose_ = Pose::Identity();
  double time_ = 0.0;                               ///< Since this way began [s].
  double share_ = 0.0;                              ///< Of this way that is gone.
  double rate_ = 0.0;                               ///< Of its change [1/s].
  Eigen::Vector3d zero_ = Eigen::Vector3d::Zero();  ///< Force when this way began [N].
  bool complete_ = true, touched_ = false, obstructed_ = false, braking_ = false;
};

}  // namespace kr5::job
