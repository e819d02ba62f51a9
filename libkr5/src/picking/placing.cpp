// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/placing.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <kr5/core/error.hpp>

namespace kr5::picking {

using Eigen::AngleAxisd;
using Eigen::Translation3d;
using Eigen::Vector3d;

namespace {

void require_pose(const Pose& T, const char* name) {
  require(T.matrix().allFinite() && is_rotation(T.linear()), std::string(name) + " is no rigid motion");
}

void require_covariance(const Matrix6& covariance, const char* name) {
  const std::string defect = covariance_defect(covariance);
  require(defect.empty(), std::string(name) + " is no covariance: " + defect);
}

void require_size(double radius, double height) {
  require(radius > 0 && radius < 1, "radius must be positive and below 1 m; is it in millimetres? [m]");
  require(height > 0 && height < 1, "height must be positive and below 1 m; is it in millimetres? [m]");
}

double angle_from_down(const Pose& T_base_tool, const Pose& T_base_seat) {
  const Vector3d down = -T_base_seat.linear().col(2);
  return std::atan2(T_base_tool.linear().col(2).cross(down).norm(), T_base_tool.linear().col(2).dot(down));
}

/// The same higher above the seat.
Pose above(const Pose& T_base_tool, const Pose& T_base_seat, double height) {
  return Translation3d(height * T_base_seat.linear().col(2)) * T_base_tool;
}

/// Pose of a cylinder on a seat, its Z up or along X of the seat, or reversed.
Pose seated(PelletPosture posture, double radius, double height, bool reversed) {
  const bool standing = posture == PelletPosture::Standing;
  Pose out(Translation3d(0, 0, standing ? height / 2 : radius));
  if (!standing) out.rotate(AngleAxisd(std::numbers::pi / 2, Vector3d::UnitY()));
  if (reversed) out.rotate(AngleAxisd(std::numbers::pi, Vector3d::UnitX()));
  return out;
}

/// Angle by which the cylinder is turned about its axis so that the tool that holds it points down, or, when that makes
/// no difference, so that the tool's X is that of the seat.
double best_turn(const Pose& T_seat_pellet, const Pose& T_pellet_tool) {
  const Eigen::Matrix3d to_pellet = T_seat_pellet.linear().transpose();
  const auto turn = [](const Vector3d& from, const Vector3d& to) {  // about Z, from the one to the other
    return std::atan2(from.x() * to.y() - from.y() * to.x(), from.head<2>().dot(to.head<2>()));
  };
  const auto across = [](const Vector3d& v) { return v.head<2>().norm(); };
  const Vector3d down = to_pellet * -Vector3d::UnitZ(), tool_z = T_pellet_tool.linear().col(2);
  if (across(down) > 1e-6 && across(tool_z) > 1e-6) return turn(tool_z, down);
  const Vector3d seat_x = to_pellet * Vector3d::UnitX(), tool_x = T_pellet_tool.linear().col(0);
  return across(tool_x) > 0.5 ? turn(tool_x, seat_x) : turn(tool_z, seat_x);
}

/// Fingers around the middle of a cylinder that lies or stands on a seat: straight from above, then leaning from there
/// towards X of the seat.
Pose fingers_at(const Pose& T_base_seat, double middle, double lean) {
  return T_base_seat * Translation3d(0, 0, middle) * AngleAxisd(std::numbers::pi, Vector3d::UnitX()) *
         AngleAxisd(lean, Vector3d::UnitY());
}

/// Collects steps; the cylinder moves with the tool that holds it.
class StepWriter {
 public:
  explicit StepWriter(HandlingPlan& plan) : steps_(plan.steps) {}

  void add(std::string name, Gripper gripper, const Pose& T_base_tool, GripperAction action,
           const UncertainPose& T_base_pellet) {
    steps_.push_back({std::move(name), gripper, T_base_tool, action, T_base_pellet});
  }
  /// Down to a place, something there, and up again.
  void visit(const std::string& name, Gripper gripper, const Pose& T_base_tool, const Pose& T_base_above,
             GripperAction action, const UncertainPose& before, const UncertainPose& at, const UncertainPose& after) {
    add("above: " + name, gripper, T_base_above, GripperAction::Keep, before);
    add(name, gripper, T_base_tool, action, at);
    add("away from: " + name, gripper, T_base_above, GripperAction::Keep, after);
  }

 private:
  std::vector<HandlingStep>& steps_;
};

/// A cylinder that rests, and the plan up to there.
struct PutDown {
  HandlingPlan plan;
  UncertainPose T_base_pellet;
};

PutDown put_down(const HeldPellet& held, const Pose& T_base_seat, PelletPosture posture, const PlaceOptions& options) {
  PutDown out;
  const Placement placement = place(held, T_base_seat, posture, options);
  out.plan.possible = placement.possible;
  out.plan.message = placement.message;
  if (!placement.possible) return out;
  out.T_base_pellet = placement.T_base_pellet;
  out.T_base_pellet.T = Translation3d(-options.release_gap * T_base_seat.linear().col(2)) * out.T_base_pellet.T;
  const UncertainPose before = UncertainPose{placement.T_base_approach, Matrix6::Zero()} * held.T_tool_pellet;
  StepWriter(out.plan).visit("put down", Gripper::Suction, placement.T_base_tool, placement.T_base_approach,
                             GripperAction::Release, before, out.T_base_pellet, out.T_base_pellet);
  return out;
}

UncertainPose in_tool(const Pose& T_base_tool, const UncertainPose& T_base_pellet, const Matrix6& grip_covariance) {
  return {T_base_tool.inverse() * T_base_pellet.T, T_base_pellet.covariance + grip_covariance};
}

UncertainPose moved_by(const Pose& T_base_tool, const UncertainPose& T_tool_pellet) {
  return {T_base_tool * T_tool_pellet.T, T_tool_pellet.covariance};
}

}  // namespace

void HeldPellet::validate() const {
  require_pose(T_tool_pellet.T, "T_tool_pellet");
  require_covariance(T_tool_pellet.covariance, "the covariance of T_tool_pellet");
  require_size(radius, height);
}

void StackOptions::validate() const {
  require(rows >= 1 && columns >= 1 && layers >= 1, "rows, columns and layers must be 1 or more");
  require(static_cast<double>(rows) * columns * layers <= 1e6,
          "rows, columns and layers give more than a million seats");
  require_size(radius, height);
  require(clearance >= 0 && std::isfinite(clearance), "clearance must not be negative [m]");
  if (posture == PelletPosture::Lying && layers > 1) {
    require(layers <= rows, "layers must not be greater than rows: each layer of lying cylinders has a row less");
    require(
        clearance < 0.8 * radius,
        "clearance must be below 0.8 of the radius: cylinders of an upper layer would fall between those below [m]");
  }
}

void PlaceOptions::validate() const {
  require(release_gap >= 0 && release_gap < 0.1, "release_gap must lie between 0 and 0.1 m [m]");
  require(retreat > 0 && retreat < 2, "retreat must be positive and below 2 m [m]");
  require(max_tilt > 0 && max_tilt <= std::numbers::pi, "max_tilt must be positive, at most pi [rad]");
}

void RegripOptions::validate() const {
  placing.validate();
  require(lean > 0 && lean < std::numbers::pi / 2, "lean must lie between 0 and pi / 2; is it in degrees? [rad]");
  require(lift > 0 && lift < 2, "lift must be positive and below 2 m [m]");
  require_covariance(grip_covariance, "grip_covariance");
}

UncertainPose pellet_pose(const Pellet& pellet) {
  UncertainPose out;
  out.T.linear() = pellet.frame;
  out.T.translation() = pellet.centre;
  require_pose(out.T, "the pose of the pellet (centre, frame)");
  out.covariance.topLeftCorner<5, 5>() = pellet.covariance.topLeftCorner<5, 5>();
  return out;
}

HeldPellet hold(const Pellet& pellet, const Pose& T_base_tool, const Matrix6& grip_covariance) {
  require_pose(T_base_tool, "T_base_tool");
  require_covariance(grip_covariance, "grip_covariance");
  const HeldPellet out{in_tool(T_base_tool, pellet_pose(pellet), grip_covariance), pellet.radius, pellet.height};
  out.validate();
  return out;
}

std::vector<StackSeat> plan_stack(const Pose& T_base_tray, const StackOptions& options) {
  require_pose(T_base_tray, "T_base_tray");
  options.validate();
  const bool standing = options.posture == PelletPosture::Standing;
  const double width = 2 * options.radius + options.clearance;
  const double length = (standing ? 2 * options.radius : options.height) + options.clearance;
  const double groove = std::sqrt(std::max(0.0, 4 * options.radius * options.radius - width * width / 4));
  std::vector<StackSeat> out;
  for (int layer = 0; layer < options.layers; ++layer) {
    const int rows = standing ? options.rows : options.rows - layer;
    const double up = layer * (standing ? options.height : groove), first_row = standing ? 0.5 : 0.5 * (1 + layer);
    const bool by_rows = options.order == GridOrder::Rows;
    for (int i = 0; i < rows * options.columns; ++i) {
      const int row = by_rows ? i / options.columns : i % rows, column = by_rows ? i % options.columns : i / rows;
      const Vector3d at((column + 0.5) * length, (row + first_row) * width, up);
      out.push_back({layer, row, column, T_base_tray * Translation3d(at)});
    }
  }
  return out;
}

Placement place(const HeldPellet& held, const Pose& T_base_seat, PelletPosture posture, const PlaceOptions& options) {
  held.validate();
  require_pose(T_base_seat, "T_base_seat");
  options.validate();
  const Pose T_pellet_tool = held.T_tool_pellet.T.inverse();
  Placement out;
  double best = -std::numeric_limits<double>::infinity();
  for (const bool reversed : {false, true}) {
    const Pose T_seat_pellet = seated(posture, held.radius, held.height, reversed);
    const double turn = best_turn(T_seat_pellet, T_pellet_tool);
    const Pose T_base_pellet = Translation3d(options.release_gap * T_base_seat.linear().col(2)) * T_base_seat *
                               T_seat_pellet * AngleAxisd(turn, Vector3d::UnitZ());
    const Pose T_base_tool = T_base_pellet * T_pellet_tool;
    const double tilt = angle_from_down(T_base_tool, T_base_seat);
    const double along = T_base_tool.linear().col(0).dot(T_base_seat.linear().col(0));
    if (const double score = -tilt + 1e-6 * along; score > best) {
      best = score;
      out.T_base_tool = T_base_tool;
      out.T_base_pellet = {T_base_pellet, held.T_tool_pellet.covariance};
      out.tilt = tilt;
    }
  }
  out.T_base_approach = above(out.T_base_tool, T_base_seat, options.retreat);
  out.possible = out.tilt <= options.max_tilt;
  const auto degrees = [](double a) { return std::to_string(std::lround(a * 180 / std::numbers::pi)) + " deg"; };
  const std::string tilts = "the tool tilts by " + degrees(out.tilt) + " from straight down";
  out.message = out.possible ? tilts
                             : tilts + ", more than " + degrees(options.max_tilt) +
                                   "; place the cylinder in the other posture, or turn it between two fingers";
  return out;
}

HandlingPlan regrip_steps(const HeldPellet& held, const Pose& T_base_seat, PelletPosture posture,
                          const RegripOptions& options) {
  options.validate();
  PutDown down = put_down(held, T_base_seat, posture, options.placing);
  if (!down.plan.possible) return down.plan;
  const double middle = posture == PelletPosture::Standing ? held.height / 2 : held.radius;
  const Pose T_base_grip = fingers_at(T_base_seat, middle, 0),
             T_base_lifted = above(T_base_grip, T_base_seat, options.lift);
  const UncertainPose held_now = in_tool(T_base_grip, down.T_base_pellet, options.grip_covariance);
  StepWriter(down.plan).visit("take with the fingers", Gripper::Fingers, T_base_grip, T_base_lifted,
                              GripperAction::Grip, down.T_base_pellet, moved_by(T_base_grip, held_now),
                              moved_by(T_base_lifted, held_now));
  return down.plan;
}

HandlingPlan stand_up_steps(const HeldPellet& held, const Pose& T_base_lying_seat, const Pose& T_base_standing_seat,
                            const RegripOptions& options) {
  options.validate();
  require_pose(T_base_standing_seat, "T_base_standing_seat");
  PutDown down = put_down(held, T_base_lying_seat, PelletPosture::Lying, options.placing);
  if (!down.plan.possible) return down.plan;
  StepWriter write(down.plan);
  // Held with a lean to one side, the cylinder stands when the fingers lean by the rest of a right angle to the other.
  const double other_lean = options.lean - std::numbers::pi / 2, gap = options.placing.release_gap;
  const Pose T_base_grip = fingers_at(T_base_lying_seat, held.radius, options.lean);
  const Pose T_base_lifted = above(T_base_grip, T_base_lying_seat, options.lift);
  const UncertainPose leaning = in_tool(T_base_grip, down.T_base_pellet, options.grip_covariance);
  write.visit("take leaning", Gripper::Fingers, T_base_grip, T_base_lifted, GripperAction::Grip, down.T_base_pellet,
              moved_by(T_base_grip, leaning), moved_by(T_base_lifted, leaning));

  const Pose T_base_release = fingers_at(T_base_standing_seat, held.height / 2 + gap, other_lean);
  const Pose T_base_over = above(T_base_release, T_base_standing_seat, options.lift);
  const UncertainPose released = moved_by(T_base_release, leaning);
  UncertainPose standing = released;
  standing.T = Translation3d(-gap * T_base_standing_seat.linear().col(2)) * standing.T;
  write.visit("stand up", Gripper::Fingers, T_base_release, T_base_over, GripperAction::Release,
              moved_by(T_base_over, leaning), standing, standing);

  const Pose T_base_final = fingers_at(T_base_standing_seat, held.height / 2, 0);
  const Pose T_base_away = above(T_base_final, T_base_standing_seat, options.lift);
  const UncertainPose upright = in_tool(T_base_final, standing, options.grip_covariance);
  write.visit("take standing", Gripper::Fingers, T_base_final, T_base_away, GripperAction::Grip, standing,
              moved_by(T_base_final, upright), moved_by(T_base_away, upright));
  return down.plan;
}

}  // namespace kr5::picking
