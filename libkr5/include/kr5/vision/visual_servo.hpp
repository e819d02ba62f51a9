// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/vision/detect.hpp>
#include <kr5/vision/find_hole.hpp>

/// @file
/// Steers a camera that the robot carries until it stands to a target as wished: position-based or image-based visual
/// servoing by ViSP's control laws (Chaumette and Hutchinson 2006, parts I and II).

namespace kr5::vision {

enum class ServoBy {
  Position,  ///< Place of the target's origin in the camera and rotation vector to the goal: the origin moves straight
             ///< across the image, so that what is seen at the start and wished in the image stays in it.
  Image,     ///< Places of the target's points in the image: they move about straight; depth from the pose.
};
constexpr auto enum_names(ServoBy) {
  return names<ServoBy>({{ServoBy::Position, "position"}, {ServoBy::Image, "image"}});
}

enum class ServoState {
  Moving,    ///< Go on; the only state in which the twist is not zero.
  Arrived,   ///< The mean of the last sights lies within the tolerance, and is certain enough to say so.
  Lost,      ///< The target was not seen for too long.
  TooFar,    ///< The first sight lies farther from the goal than allowed: nothing was moved.
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
  ServoBy by = ServoBy::Position;
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
    visit("by", self.by, "position | image: what is regulated.");
    visit("turn_free", self.turn_free, "The turn about Z of the target does not count and is left alone: a bore's.");
    visit("cycle", self.cycle, "Time from one image to the next [s].");
    visit("latency", self.latency, "Time from the image until the robot moves as the twist says [s].");
    visit("gain", self.gain, "The error decays at this rate when it is large [1/s].");
    visit("gain_near", self.gain_near,
          "The same close to the goal; neither may exceed 0.5 / (cycle + latency): beyond, the loop swings [1/s].");
    visit("gain_slope", self.gain_slope,
          "How fast the gain falls from near to far with the largest error of a feature, which is in m, rad, or x/z of "
          "the image [1/s].");
    visit("max_speed", self.max_speed, "Of the camera; the whole twist is slowed, so that its path stays [m/s].");
    visit("max_turn_rate", self.max_turn_rate, "Of the camera, in the same way [rad/s].");
    visit("tolerance_position", self.tolerance_position, "Arrived means: the camera is no farther from its goal [m].");
    visit("tolerance_angle", self.tolerance_angle, "And is turned no farther from it [rad].");
    visit("settle", self.settle, "Sights in a row over which arrival is judged, at least 2.");
    visit("max_distance", self.max_distance, "The first sight may be so far from the goal [m].");
    visit("max_angle", self.max_angle, "And be turned so far from it [rad].");
    visit("lost_after", self.lost_after, "Without a sight the camera stands; for so long it waits for one [s].");
    visit("stalled_after", self.stalled_after, "For so long the error may fail to shrink [s].");
    visit("time_limit", self.time_limit, "From the first step [s].");
  }
};

/// What one image says of the target. Make it by `see_target` or `see_hole`, or fill it from a tracker of your own.
struct ServoSight {
  bool seen = false;
  std::string message = "not run";  ///< Why it was not seen.
  Pose T_camera_target = Pose::Identity();
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd(3, 0);  ///< [m]
  Eigen::Matrix2Xd rays = Eigen::Matrix2Xd(2, 0);    ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("seen", self.seen, "The target is in the image, and the other fields say where.");
    visit("message", self.message, "Why it was not seen.");
    visit("T_camera_target", self.T_camera_target, "Pose of the target in the camera.");
    visit("points", self.points, "Points of the target in its own frame, 3 x n, for image-based steering [m].");
    visit("rays", self.rays, "Where they are seen, x/z and y/z without the lens, 2 x n [-].");
  }
};

/// Looks for a target in the image without its lens: one marker alone does not tell the bend of its sides from its
/// tilt. A view that two poses explain counts as not seen.
/// @throws InvalidArgument as find_target, and for an image of another size than the camera's.
ServoSight see_target(ImageView image, const Target& target, const Pinhole& camera, const DetectOptions& options = {});
/// The sight of a bore that `find_hole` looked for: Z is that of the known plane, the turn about it that of the plane's
/// frame (use `turn_free`), the rays are those of four points of the face two radii from the centre.
ServoSight see_hole(const HoleSight& hole);

struct ServoStep {
  ServoState state = ServoState::Moving;
  std::string reason;               ///< In words.
  Vector6 twist = Vector6::Zero();  ///< [m/s, rad/s]
  double error_position = 0.0;      ///< [m]
  double error_angle = 0.0;         ///< [rad]

  static void each_field(auto& self, auto&& visit) {
    visit("state", self.state, "Whether to go on, and how it ended.");
    visit("reason", self.reason, "The same in words.");
    visit("twist", self.twist, "How the camera shall move, in its own frame: v, omega [m/s, rad/s].");
    visit("error_position", self.error_position,
          "Distance of the camera from its goal by the last sight; on arrival by the mean of the last `settle` [m].");
    visit("error_angle", self.error_angle, "The same for its turn [rad].");
  }
};

/// One approach. Call `step` with each image's sight until the state is no longer Moving.
class VisualServo {
 public:
  /// `T_camera_target_goal`: how the target shall stand in the camera.
  /// @throws InvalidArgument for a pose that is no rigid motion or puts the target behind the camera, and bad options.
  VisualServo(const Pose& T_camera_target_goal, const VisualServoOptions& options = {});
  ~VisualServo();
  VisualServo(VisualServo&&) noexcept;
  VisualServo& operator=(VisualServo&&) noexcept;

  /// `time` of the image [s], from any epoch. After the end the last step is repeated, with zero twist.
  /// @throws InvalidArgument for a time that does not grow, NaN in a sight, or, image-based, fewer than three points.
  ServoStep step(const ServoSight& sight, double time);

 private:
  class Course;
  std::unique_ptr<Course> course_;
};

}  // namespace kr5::vision
