// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/vision/visual_servo.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <limits>
#include <numbers>

#include <kr5/core/error.hpp>

#include "vision/servo/visp_servo.hpp"

namespace kr5::vision {
namespace {

using Eigen::Vector3d;

constexpr double diverging = 50.0;  // [tolerances] 10 mm: more than observations scatter, or points move that swing in

std::string in_words(double metres, double radians) {
  char text[64];
  std::snprintf(text, sizeof text, "%.2f mm and %.2f deg", 1e3 * metres, radians * 180 / std::numbers::pi);
  return text;
}

/// The goal turned about the target's Z to where the least turn of the camera remains.
Pose nearest_turn(const Pose& goal, const Pose& now) {
  const Eigen::Matrix3d M = goal.linear().transpose() * now.linear();
  return goal * Eigen::AngleAxisd(std::atan2(M(1, 0) - M(0, 1), M(0, 0) + M(1, 1)), Vector3d::UnitZ());
}

void require_sound(const TargetObservation& observation, ServoFeature feature, const Pose& goal) {
  require(observation.T_camera_target.matrix().allFinite() && is_rotation(observation.T_camera_target.linear()),
          "visual_servo: T_camera_target of the observation must be a rigid motion");
  if (feature == ServoFeature::Position) return;
  require(observation.points.cols() >= 3 && observation.points.cols() == observation.rays.cols(),
          "visual_servo: for the feature image, an observation needs at least three points, and a ray for each");
  require(observation.points.allFinite() && observation.rays.allFinite(),
          "visual_servo: points and rays of an observation must be finite");
  require((observation.T_camera_target * observation.points).row(2).minCoeff() > 0,
          "visual_servo: points of the observation lie behind the camera");
  require((goal * observation.points).row(2).minCoeff() > 0,
          "visual_servo: at the goal points of the target would lie behind the camera");
}

}  // namespace

robot::RobotCommand servo_command(const ServoStep& step, const Pose& T_tool_camera, double cycle) noexcept {
  if (step.twist.isZero(0)) return {};
  const Pose motion = to_pose(Vector6(step.twist * cycle));
  return robot::tool_motion(T_tool_camera * motion * T_tool_camera.inverse(), robot::CommandFrame::Tool);
}

class VisualServo::Impl {
 public:
  Impl(const Pose& goal, const VisualServoOptions& options) : goal_(goal), options_(options) {}

  ServoStep step(const TargetObservation& observation, double time) {
    require(std::isfinite(time) && !(time <= time_), "visual_servo: time must increase from step to step [s]");
    if (observation.seen) require_sound(observation, options_.feature, goal_);
    if (last_.state != ServoState::Moving) return last_;
    if (std::isnan(start_)) start_ = seen_ = time;
    time_ = time;
    last_.twist.setZero();
    if (observation.seen) return steer(observation);
    recent_.clear();
    if (time_ - seen_ >= options_.lost_after) return end(ServoState::Lost, lost(observation.message));
    return over_time() ? out_of_time() : go("waiting for an observation: " + observation.message);
  }

 private:
  ServoStep steer(const TargetObservation& observation) {
    const Pose goal = options_.turn_free ? nearest_turn(goal_, observation.T_camera_target) : goal_;
    const Vector6 error = to_vector(goal * observation.T_camera_target.inverse());
    const bool first = std::isinf(best_);
    seen_ = time_;
    note(error);
    if (first && (last_.error_position > options_.max_distance || last_.error_angle > options_.max_angle))
      return end(ServoState::TooFar,
                 "the first observation is " + left() + " from the goal, more than max_distance or max_angle");
    if (arrived()) return end(ServoState::Arrived, "arrived: " + left() + " from the goal");
    if (over_time()) return out_of_time();
    if (in_tolerances() > 2 * best_ + diverging)
      return end(ServoState::Diverged,
                 "the error grows and is now " + left() +
                     "; check the hand-eye calibration, and the frame in which the robot takes the twist");
    if (time_ - best_time_ > options_.stalled_after) return end(ServoState::Stalled, stalled());
    const detail::ServoTwist law = control_law(observation, goal);
    if (!law.failure.empty()) return end(ServoState::Stalled, law.failure);
    last_.twist = slowed(law.twist);
    return go("moving, with " + left() + " to go");
  }

  /// Takes the error into what is known of the course.
  void note(const Vector6& error) {
    if (!recent_.empty()) path_seen_ += units(error - recent_.back());
    path_told_ += units(told_ * options_.cycle);
    told_.setZero();
    recent_.push_back(error);
    if (recent_.size() > static_cast<std::size_t>(options_.settle)) recent_.pop_front();
    last_.error_position = error.head<3>().norm(), last_.error_angle = error.tail<3>().norm();
    if (in_tolerances() < 0.95 * best_) best_ = in_tolerances(), best_time_ = time_, path_seen_ = path_told_ = 0;
  }

  detail::ServoTwist control_law(const TargetObservation& observation, const Pose& goal) const {
    const detail::ServoGain gain{options_.gain, options_.gain_near, options_.gain_slope};
    if (options_.feature == ServoFeature::Position)
      return detail::visp_position_law(observation.T_camera_target, goal, gain);
    const Eigen::Matrix3Xd there = goal * observation.points;
    Eigen::Matrix3Xd now(3, there.cols()), then(3, there.cols());
    now << observation.rays, (observation.T_camera_target * observation.points).row(2);
    then << there.colwise().hnormalized(), there.row(2);
    return detail::visp_image_law(now, then, gain);
  }

  Vector6 slowed(const Vector6& twist) {
    const double speed = twist.head<3>().norm() / options_.max_speed,
                 rate = twist.tail<3>().norm() / options_.max_turn_rate;
    return told_ = twist / std::max({1.0, speed, rate});
  }

  /// The mean over the last observations is close, and they scatter so little that it is to be believed.
  bool arrived() {
    if (recent_.size() < static_cast<std::size_t>(options_.settle)) return false;
    const Vector6 mean = mean_error();
    const double position = mean.head<3>().norm(), angle = mean.tail<3>().norm(), root = std::sqrt(options_.settle);
    const auto [by_position, by_angle] = scatter();
    const bool near = position <= options_.tolerance_position && angle <= options_.tolerance_angle;
    const bool sure =
        by_position <= 0.5 * root * options_.tolerance_position && by_angle <= 0.5 * root * options_.tolerance_angle;
    if (near && sure) last_.error_position = position, last_.error_angle = angle;
    return near && sure;
  }

  Vector6 mean_error() const {
    Vector6 sum = Vector6::Zero();
    for (const Vector6& e : recent_) sum += e;
    return sum / static_cast<double>(recent_.size());
  }

  /// Standard deviation of the last observations' errors in position [m] and angle [rad].
  std::pair<double, double> scatter() const {
    const Vector6 mean = mean_error();
    double position = 0, angle = 0;
    for (const Vector6& e : recent_)
      position += (e - mean).head<3>().squaredNorm(), angle += (e - mean).tail<3>().squaredNorm();
    const double count = std::max(1.0, static_cast<double>(recent_.size()) - 1);
    return {std::sqrt(position / count), std::sqrt(angle / count)};
  }

  std::string stalled() const {
    const auto [position, angle] = scatter();
    const std::string text = "no progress for " + std::to_string(static_cast<int>(std::round(time_ - best_time_))) +
                             " s, with " + left() + " to go; ";
    if (position > options_.tolerance_position || angle > options_.tolerance_angle)
      return text + "the observations scatter by " + in_words(position, angle) +
             "; use more light, a nearer target or a wider tolerance";
    if (path_seen_ < 0.3 * path_told_)
      return text + "the camera hardly follows the commanded twist; does the robot execute it?";
    return text + "the robot stops before the goal; check its limits, and gain_near";
  }

  std::string lost(const std::string& why) const {
    const bool never = std::isinf(best_);
    return std::string(never ? "the target was never seen" : "the target was lost") + " (" + why + "); " +
           (never ? "start where the whole target is in the image" : "check what hides it");
  }

  /// The error in units of the tolerance.
  double in_tolerances() const {
    return std::max(last_.error_position / options_.tolerance_position, last_.error_angle / options_.tolerance_angle);
  }
  double units(const Vector6& motion) const {
    return motion.head<3>().norm() / options_.tolerance_position + motion.tail<3>().norm() / options_.tolerance_angle;
  }
  std::string left() const { return in_words(last_.error_position, last_.error_angle); }
  bool over_time() const { return time_ - start_ >= options_.time_limit; }
  ServoStep out_of_time() {
    return end(ServoState::TimedOut,
               "the time limit is reached, with " + left() + " to go; raise time_limit, max_speed or gain");
  }
  ServoStep go(const std::string& reason) {
    last_.reason = reason;
    return last_;
  }
  ServoStep end(ServoState state, const std::string& reason) {
    last_.state = state;
    return go(reason);
  }

  Pose goal_;
  VisualServoOptions options_;
  ServoStep last_;
  std::deque<Vector6> recent_;  ///< Errors of the last observations in a row: the camera in its goal.
  Vector6 told_ = Vector6::Zero();
  double start_ = std::numeric_limits<double>::quiet_NaN(), time_ = -std::numeric_limits<double>::infinity();
  double seen_ = 0, best_ = std::numeric_limits<double>::infinity(), best_time_ = 0;
  double path_seen_ = 0, path_told_ = 0;  ///< Since it was best, in tolerances.
};

void VisualServoOptions::validate() const {
  const auto positive = [](double value, const char* field) {
    require(std::isfinite(value) && value > 0, std::string("visual_servo: ") + field + " must be positive");
  };
  positive(cycle, "cycle [s]"), positive(gain, "gain [1/s]"), positive(gain_slope, "gain_slope [1/s]");
  positive(max_speed, "max_speed [m/s]"), positive(max_turn_rate, "max_turn_rate [rad/s]");
  positive(tolerance_position, "tolerance_position [m]"), positive(tolerance_angle, "tolerance_angle [rad]");
  positive(max_distance, "max_distance [m]"), positive(max_angle, "max_angle [rad]");
  positive(lost_after, "lost_after [s]"), positive(stalled_after, "stalled_after [s]");
  positive(time_limit, "time_limit [s]");
  require(std::isfinite(latency) && latency >= 0, "visual_servo: latency must not be negative [s]");
  require(std::isfinite(gain_near) && gain_near >= gain, "visual_servo: gain_near must not be below gain [1/s]");
  require(gain_near * (cycle + latency) <= 0.5,
          "visual_servo: gain_near is too large: above 0.5 / (cycle + latency) the loop oscillates [1/s]");
  require(settle >= 2, "visual_servo: settle must be at least 2");
}

VisualServo::VisualServo(const Pose& T_camera_target_goal, const VisualServoOptions& options) {
  options.validate();
  require(T_camera_target_goal.matrix().allFinite() && is_rotation(T_camera_target_goal.linear()),
          "visual_servo: T_camera_target_goal must be a rigid motion");
  require(T_camera_target_goal.translation().z() > 0,
          "visual_servo: T_camera_target_goal puts the target behind the camera");
  impl_ = std::make_unique<Impl>(T_camera_target_goal, options);
}

VisualServo::~VisualServo() = default;
VisualServo::VisualServo(VisualServo&&) noexcept = default;
VisualServo& VisualServo::operator=(VisualServo&&) noexcept = default;

ServoStep VisualServo::step(const TargetObservation& observation, double time) {
  return impl_->step(observation, time);
}

}  // namespace kr5::vision
