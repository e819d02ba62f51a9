// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/robot/command.hpp>
#include <kr5/vision/target_observation.hpp>

/// @file
/// Steers a camera that the robot carries until it reaches a desired pose to a target: position-based or image-based
/// visual servoing by ViSP's control laws (Chaumette and Hutchinson 2006, parts I and II).

namespace kr5::vision {

enum class ServoFeature {
  Position,  ///< Place of the target's origin in the camera and rotation vector to the goal: the origin moves straight
             ///< across the image, so that what is seen at the start and wished in the image stays in it.
  Image,     ///< Places of the target's points in the image: they move about straight; depth from the pose.
};
constexpr auto enum_names(ServoFeature) {
  return names<ServoFeature>({{ServoFeature::Position, "position"}, {ServoFeature::Image, "image"}});
}

enum class ServoState {
  Moving,    ///< Go on; the only state in which the twist is not zero.
  Arrived,   ///< The mean of the last observations lies within the tolerance, and is certain enough to say so.
  Lost,      ///< The target was not seen for too long.
  TooFar,    ///< The first observation lies farther from the goal than allowed: nothing was moved.
  Diverged,  ///< The error grows.
  Stalled,   ///< The error does not get smaller, and is above the tolerance.
  TimedOut,
};
constexpr auto enum_names(ServoState) {
  return names<ServoState>({{ServoState::Moving, "moving"},
                            {ServoState::Arrived, "arrived"},
                            {ServoState::Lost, "lost"},
                            {ServoState::TooFar, "too_far"},
                            {ServoState::Diverged, "diverged"},
                            {ServoState::Stalled, "stalled"},
                            {ServoState::TimedOut, "timed_out"}});
}

struct VisualServoOptions {
  ServoFeature feature = ServoFeature::Position;
  bool turn_free = false;
  double cycle = 0.1;                ///< [s]
  double latency = 0.1;              ///< [s]
  double gain = 1.0;                 ///< [1/s]
  double gain_near = 2.0;            ///< [1/s]
  double gain_slope = 20.0;          ///< [1/s]
  double max_speed = 0.1;            ///< [m/s]
  double max_turn_rate = 0.5;        ///< [rad/s]
  double tolerance_position = 2e-4;  ///< [m]
  double tolerance_angle = 2e-3;     ///< [rad]
  int settle = 4;
  double max_distance = 0.3;   ///< [m]
  double max_angle = 0.8;      ///< [rad]
  double lost_after = 0.5;     ///< [s]
  double stalled_after = 3.0;  ///< [s]
  double time_limit = 20.0;    ///< [s]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("feature", self.feature, "Regulated feature: position | image.");
    visit("turn_free", self.turn_free, "Free rotation about Z of the target, as for a bore: it is not regulated.");
    visit("cycle", self.cycle, "Cycle time, from one image to the next [s].");
    visit("latency", self.latency, "Latency from the image to the motion of the robot [s].");
    visit("gain", self.gain, "Gain far from the goal: decay rate of a large error [1/s].");
    visit("gain_near", self.gain_near,
          "Gain close to the goal; neither gain may exceed 0.5 / (cycle + latency), beyond which the loop oscillates "
          "[1/s].");
    visit("gain_slope", self.gain_slope,
          "Slope by which the gain falls with the largest error of a feature, which is in m, rad, or x/z of the image "
          "[1/s].");
    visit("max_speed", self.max_speed,
          "Maximum speed of the camera; the whole twist is scaled, so that the path stays [m/s].");
    visit("max_turn_rate", self.max_turn_rate,
          "Maximum angular speed of the camera; the whole twist is scaled [rad/s].");
    visit("tolerance_position", self.tolerance_position,
          "Distance of the camera from its goal at which it has arrived [m].");
    visit("tolerance_angle", self.tolerance_angle, "Angle of the camera to its goal at which it has arrived [rad].");
    visit("settle", self.settle, "Number of consecutive observations over which arrival is judged, at least 2.");
    visit("max_distance", self.max_distance, "Maximum distance from the goal at the first observation [m].");
    visit("max_angle", self.max_angle, "Maximum angle to the goal at the first observation [rad].");
    visit("lost_after", self.lost_after,
          "Time without an observation, during which the camera stands, after which the target is lost [s].");
    visit("stalled_after", self.stalled_after,
          "Time without decrease of the error after which the approach has stalled [s].");
    visit("time_limit", self.time_limit, "Time limit from the first step [s].");
  }
};

struct ServoStep {
  ServoState state = ServoState::Moving;
  std::string reason;               ///< In words.
  Vector6 twist = Vector6::Zero();  ///< [m/s, rad/s]
  double error_position = 0.0;      ///< [m]
  double error_angle = 0.0;         ///< [rad]

  static void each_field(auto& self, auto&& visit) {
    visit("state", self.state, "State of the approach.");
    visit("reason", self.reason, "Explanation of the state.");
    visit("twist", self.twist, "Commanded twist of the camera in its own frame: v, omega [m/s, rad/s].");
    visit("error_position", self.error_position,
          "Distance of the camera from its goal by the last observation; on arrival by the mean of the last `settle` "
          "[m].");
    visit("error_angle", self.error_angle, "Angle of the camera to its goal, in the same way [rad].");
  }
};

/// What the robot is told for a cycle in which its camera shall move by the twist of a step: a motion of the tool in
/// its own axes; nothing where the twist is zero.
/// @param T_tool_camera Where the robot carries the camera. @param cycle Until the next command [s].
robot::RobotCommand servo_command(const ServoStep& step, const Pose& T_tool_camera, double cycle) noexcept;

/// One approach. Call `step` with the observation of each image until the state is no longer Moving.
class VisualServo {
 public:
  /// `T_camera_target_goal`: how the target shall stand in the camera.
  /// @throws InvalidArgument for a pose that is no rigid motion or puts the target behind the camera, and bad options.
  VisualServo(const Pose& T_camera_target_goal, const VisualServoOptions& options = {});
  ~VisualServo();
  VisualServo(VisualServo&&) noexcept;
  VisualServo& operator=(VisualServo&&) noexcept;

  /// `time` of the image [s], from any epoch. After the end the last step is repeated, with zero twist.
  /// @throws InvalidArgument for a time that does not increase, NaN in an observation, or, image-based, fewer than
  /// three points.
  ServoStep step(const TargetObservation& observation, double time);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kr5::vision
