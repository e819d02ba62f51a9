// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/job/tool_path.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/robot/quintic_profile.hpp>

namespace kr5::job {
namespace {

constexpr double getting_up = 0.2;        // to the one speed of a steady way, and down from it [s]
constexpr double joint_way_error = 1e-5;  // of the ends of a joint way against the poses between which it is [m, rad]

bool same_pose(const Pose& a, const Pose& b) noexcept {
  return (a.translation() - b.translation()).norm() < joint_way_error &&
         log_rotation(a.linear().transpose() * b.linear()).norm() < joint_way_error;
}

/// Share of a way that is gone at one speed but for smooth ends: of its speed, in times of getting up to it.
double steady_share(double time, double duration) noexcept {
  const auto gone = [](double part) { return part * part * part * (1.0 - 0.5 * part); };
  const double whole = duration / getting_up - 1.0, begun = time / getting_up, left = (duration - time) / getting_up;
  if (begun < 1.0) return gone(begun) / whole;
  return left < 1.0 ? 1.0 - gone(left) / whole : (begun - 0.5) / whole;
}

}  // namespace

void PathLimits::validate() const {
  require(speed > 0 && speed <= 10, "speed must lie between 0 and 10 m/s");
  require(acceleration > 0 && acceleration <= 1e3, "acceleration must lie between 0 and 1000 m/s^2");
  require(turning_speed > 0 && turning_speed <= 100, "turning_speed must lie between 0 and 100 rad/s");
  require(turning_acceleration > 0 && turning_acceleration <= 1e4,
          "turning_acceleration must lie between 0 and 10000 rad/s^2");
  require(scan_speed > 0 && scan_speed <= speed, "scan_speed must lie between 0 and speed [m/s]");
  require(contact_speed > 0 && contact_speed <= speed, "contact_speed must lie between 0 and speed [m/s]");
  require(careful_speed > 0 && careful_speed <= 10, "careful_speed must lie between 0 and 10 m/s");
  require(obstacle_force > 0 && std::isfinite(obstacle_force), "obstacle_force must be positive [N]");
  require(touch_force > 0 && std::isfinite(touch_force), "touch_force must be positive [N]");
  require(settling >= 0 && settling <= 1, "settling must lie between 0 and 1 s");
}

ToolPath::ToolPath(const PathLimits& limits, double cycle, const std::optional<robot::SensorModel>& arm)
    : limits_(limits), cycle_(cycle), arm_(arm) {
  limits.validate();
  if (arm) arm->validate();
  require(cycle > 0 && std::isfinite(cycle), "cycle: must be positive [s]");
}

void ToolPath::start(const Pose& T_base_tool) noexcept {
  pose_ = T_base_tool;
  count_ = at_ = 0;
  time_ = share_ = rate_ = 0.0;
  complete_ = true;
  touched_ = obstructed_ = braking_ = false;
}

double ToolPath::speed_of(Way way) const noexcept {
  switch (way) {
    case Way::Free:
      return limits_.speed;
    case Way::Careful:
      return std::min(limits_.careful_speed, limits_.speed);
    case Way::Scan:
      return limits_.scan_speed;
    default:
      return limits_.contact_speed;
  }
}

void ToolPath::add(const Pose& T_base_tool, Way way) noexcept {
  if (count_ == capacity) {
    complete_ = false;
    return;
  }
  Segment& s = segments_[count_];
  s.from = count_ > 0 ? segments_[count_ - 1].to : pose_;
  s.to = T_base_tool;
  s.way = way;
  s.known = false;
  const Eigen::AngleAxisd turn(s.from.linear().transpose() * s.to.linear());
  s.turn = turn.angle() * turn.axis();
  const double length = (s.to.translation() - s.from.translation()).norm(), angle = std::abs(turn.angle());
  const double speed = speed_of(way);
  constexpr robot::QuinticProfile peak = robot::quintic_profile_peak;
  const double time = std::max({peak.v * length / speed, std::sqrt(peak.a * length / limits_.acceleration),
                                peak.v * angle / limits_.turning_speed,
                                std::sqrt(peak.a * angle / limits_.turning_acceleration), cycle_});
  const double at_once = length / speed + getting_up;
  s.steady = way == Way::Careful && angle == 0.0 && length > speed * getting_up &&
             1.5 * speed <= limits_.acceleration * getting_up;
  s.duration = std::ceil((s.steady ? at_once : time) / cycle_) * cycle_;
  s.max_braking = peak.a / (s.duration * s.duration);
  if (length > 0 || angle > 0)
    s.max_braking = std::min(length > 0 ? limits_.acceleration / length : HUGE_VAL,
                             angle > 0 ? limits_.turning_acceleration / angle : HUGE_VAL);
  ++count_;
}

Pose ToolPath::tool_at(const robot::JointVector& joints) const noexcept {
  return robot::flange_pose(arm_->arm, joints) * arm_->T_flange_tool;
}

bool ToolPath::set_joint_way(const JointWay& way) noexcept {
  std::size_t k = at_;
  while (k < count_ && (segments_[k].way != Way::Joint || segments_[k].known)) ++k;
  if (k >= count_ || !arm_) return false;
  const auto joints = static_cast<Eigen::Index>(arm_->arm.joints.size());
  if (way.begin.size() != joints || way.end.size() != joints || way.bow.size() != joints) return false;
  Segment& s = segments_[k];
  if (!way.bow.allFinite() || !(way.duration >= 0.0) || !std::isfinite(way.duration)) return false;
  if (!same_pose(tool_at(way.begin), s.from) || !same_pose(tool_at(way.end), s.to)) return false;
  s.joints = way;
  s.known = true;
  s.duration = std::max(std::ceil(way.duration / cycle_), 1.0) * cycle_;
  s.max_braking = robot::quintic_profile_peak.a / (s.duration * s.duration);
  return true;
}

void ToolPath::go_to(const Segment& segment, double share) noexcept {
  rate_ = (share - share_) / cycle_;
  share_ = share;
  if (segment.way == Way::Joint) {
    pose_ = tool_at(segment.joints.at(share));
    return;
  }
  pose_.translation() = segment.from.translation() + share * (segment.to.translation() - segment.from.translation());
  const double angle = segment.turn.norm();
  pose_.linear() = segment.from.linear();
  if (angle > 0) pose_.linear() *= Eigen::AngleAxisd(share * angle, segment.turn / angle).toRotationMatrix();
}

/// Whether something is touched that was looked for, or met that should not be there.
void ToolPath::feel(const Segment& segment, const Eigen::Vector3d& force) noexcept {
  if (segment.way != Way::Guarded && segment.way != Way::Careful) return;
  if (time_ <= limits_.settling) zero_ = force;
  const Eigen::Vector3d way = segment.to.translation() - segment.from.translation(), felt = force - zero_;
  const double length = way.norm();
  if (segment.way == Way::Careful)
    obstructed_ = obstructed_ || felt.norm() >= limits_.obstacle_force;
  else
    touched_ = touched_ || (length > 0 && -felt.dot(way) >= limits_.touch_force * length);
}

const Pose& ToolPath::step(const Eigen::Vector3d& force) noexcept {
  if (at_ >= count_ || (waiting() && !braking_)) return pose_;
  const Segment& segment = segments_[at_];
  feel(segment, force);
  if (touched_ || obstructed_ || braking_) return brake();
  time_ += cycle_;
  const bool arrived = time_ > segment.duration - 0.5 * cycle_;
  const double share =
      segment.steady ? steady_share(time_, segment.duration) : robot::quintic_profile(time_ / segment.duration).x;
  go_to(segment, arrived ? 1.0 : share);
  if (!arrived) return pose_;
  pose_ = segment.to;
  ++at_;
  time_ = share_ = rate_ = 0.0;
  return pose_;
}

const Pose& ToolPath::brake() noexcept {
  if (at_ >= count_) return pose_;
  braking_ = true;
  const Segment& segment = segments_[at_];
  const double rate = std::max(rate_ - segment.max_braking * cycle_, 0.0);
  if (rate > 0.0) go_to(segment, std::min(share_ + rate * cycle_, 1.0));
  rate_ = rate;
  if (rate > 0.0 && share_ < 1.0) return pose_;
  rate_ = 0.0;
  at_ = count_;
  return pose_;
}

}  // namespace kr5::job
