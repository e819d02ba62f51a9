// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/insertion.hpp>

#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>
#include <kr5/physics/contact.hpp>
#include <kr5/physics/tube.hpp>
#include <kr5/robot/quintic_profile.hpp>
#include <kr5/robot/servo_feedforward.hpp>
#include <kr5/sim/insertion_options.hpp>

#include "actual_cell.hpp"
#include "insertion_arm.hpp"
#include "insertion_limits.hpp"
#include "scene_rows.hpp"

namespace kr5::sim {
namespace {

using Eigen::Vector3d;
using force::Insertion;
using force::InsertionOptions;
using robot::RobotReading;

constexpr double carry_speed = 0.3;  // greatest, on the way there and back [m/s]
constexpr double picking = 0.3;      // [s]
constexpr double falling = 1.0;      // given to a peg that was let go [s]
constexpr double most_of = 0.9;      // of the depth that counts as inserted

std::vector<std::string> columns(int joints) {
  std::vector<std::string> out = {"t",  "peg", "phase", "attempt", "x",  "y",      "z",      "tilt",   "azimuth",  "fx",
                                  "fy", "fz",  "tx",    "ty",      "tz", "true_x", "true_y", "true_z", "true_tilt"};
  for (int i = 1; i <= joints; ++i) out.push_back("q" + std::to_string(i));
  return out;
}

/// One task from beginning to end.
class Task {
 public:
  Task(const cell::Cell& given, const InsertionSetup& setup, const InsertionOptions& options)
      : setup_(setup),
        options_(options),
        cell_(actual_cell(given, setup)),
        arm_(cell_, setup),
        insertion_(options),
        rows_(columns(cell_.robot.joints())) {}

  InsertionResult run() {
    InsertionResult out;
    Pose start = Pose::Identity();
    start.translation().z() = above;
    if (options_.hole) start.translation() += *options_.hole;
    const bool reachable = arm_.start(start, options_.tilt);
    insertion_ = Insertion(options_, arm_.frames());
    for (int peg = 1; peg <= setup_.pegs; ++peg) {
      const double begun = arm_.time();
      if (peg > 1) fetch(peg);
      out.pegs.push_back(reachable ? insert(peg) : out_of_reach());
      out.pegs.back().time = arm_.time() - begun;
      if (!out.pegs.back().inserted) break;
    }
    out.inserted = static_cast<int>(out.pegs.size()) == setup_.pegs && out.pegs.back().inserted;
    out.time = arm_.time();
    out.profile = profile();
    if (setup_.log && reachable) out.rows = rows_.table();
    out.cell = cell_;
    out.T_tube_actual = arm_.tube();
    return out;
  }

 private:
  static PegOutcome out_of_reach() {
    PegOutcome out;
    out.phase = force::Phase::Approach;
    out.reason = force::Reason::OutOfReach;
    out.attempts = 1;
    out.hole_error = std::numeric_limits<double>::quiet_NaN();
    return out;
  }

  PegOutcome insert(int peg) {
    PegOutcome out;
    out.hole_error = std::numeric_limits<double>::quiet_NaN();
    arm_.peg().forget_max_force();
    while (!insertion_.finished()) {
      const force::Phase before = insertion_.state().phase;
      cycle(peg);
      const force::InsertionState& now = insertion_.state();
      if (before != force::Phase::Locate || now.phase != force::Phase::Aim || now.hole_std == 0) continue;
      out.hole_error = (now.hole - arm_.tube().translation()).head<2>().norm();
      out.hole_std = now.hole_std;
      out.hole = now.hole;
    }
    const double end = arm_.time() + (options_.insert_by == force::InsertBy::Arm ? 0.0 : falling);
    while (arm_.time() < end && -arm_.peg().pose().translation().z() < options_.motion.depth) arm_.send(last_);
    const force::InsertionState& state = insertion_.state();
    out.phase = state.stopped_in;
    out.reason = state.reason;
    out.attempts = state.attempt;
    const Vector3d bottom = arm_.peg().pose().translation();
    out.depth = -bottom.z();
    out.inserted = out.depth >= most_of * options_.motion.depth && bottom.head<2>().norm() < cell_.tube->inner_radius;
    out.max_force = arm_.peg().max_force();
    return out;
  }

  void cycle(int peg) {
    const RobotReading reading = arm_.read();
    last_ = insertion_.step(reading);
    if (setup_.log) note(peg, reading);
    arm_.send(last_);
  }

  /// Leaves the peg behind and comes back with another one.
  void fetch(int peg) {
    Pose over = Pose::Identity();
    over.translation() << insertion_.state().hole.head<2>(), insertion_.state().hole.z() + above;
    Pose aside = over;
    aside.translation() += Vector3d(setup_.pick_distance, 0.0, lift);
    arm_.peg().leave();
    carry(peg, aside);
    arm_.regrip();
    arm_.hold_peg();
    for (double t = 0.0; t < picking; t += arm_.cycle()) wait(peg);
    carry(peg, over);
    insertion_.restart();
  }

  void wait(int peg) {
    const RobotReading reading = arm_.read();
    if (setup_.log) note(peg, reading);
    arm_.send(last_);
  }

  /// Smoothly to a pose, led ahead as the servo of the path needs it.
  void carry(int peg, const Pose& to) {
    const Pose from = force::T_tube_peg(arm_.frames(), arm_.read());
    const Vector3d way = to.translation() - from.translation();
    const PathLimits most = path_limits(cell_);
    const double duration =
        std::max({robot::quintic_profile_peak.v * way.norm() / std::min(carry_speed, most.speed),
                  std::sqrt(robot::quintic_profile_peak.a * way.norm() / most.acceleration), arm_.cycle()});
    const robot::ServoFeedforward lead(options_.servo_frequency, options_.servo_damping);
    for (double t = arm_.cycle(); t < duration + 2 * arm_.cycle(); t += arm_.cycle()) {
      const robot::QuinticProfile now = robot::quintic_profile(t / duration);
      const double v = now.v / duration, a = now.a / (duration * duration);
      last_ = robot::tool_command(force::T_base_tool(
          arm_.frames(), Pose(Eigen::Translation3d(from.translation() + way * (now.x + lead(v, a))))));
      wait(peg);
    }
  }

  void note(int peg, const RobotReading& r) {
    const force::InsertionState& s = insertion_.state();
    const Pose T_tube_peg = force::T_tube_peg(arm_.frames(), r);
    const Vector6 wrench = force::wrench_on_peg(arm_.frames(), r);
    const Vector3d axis = T_tube_peg.linear().col(2), p = T_tube_peg.translation();
    const Pose& real = arm_.peg().pose();
    std::vector<double> row = {arm_.time(),
                               static_cast<double>(peg),
                               static_cast<double>(s.phase),
                               static_cast<double>(s.attempt),
                               p.x(),
                               p.y(),
                               p.z(),
                               std::atan2(std::hypot(axis.x(), axis.y()), axis.z()),
                               std::atan2(axis.y(), axis.x())};
    row.insert(row.end(), wrench.begin(), wrench.end());
    row.insert(row.end(), real.translation().begin(), real.translation().end());
    row.push_back(std::acos(std::min(real.linear()(2, 2), 1.0)));
    row.insert(row.end(), arm_.position().begin(), arm_.position().end());
    rows_.add(std::move(row));
  }

  io::Table profile() const {
    RowTable rows({"azimuth", "tilt", "x", "y", "height", "closed_form", "force", "moment_x", "moment_y"});
    const force::PegTube bodies{cell_.peg->radius, physics::tube_radius(cell_), cell_.tube->outer_radius};
    for (const force::ProfileRow& r : insertion_.profile())
      rows.add({r.azimuth, r.tilt, r.centre.x(), r.centre.y(), r.height,
                force::resting_height(bodies, arm_.tube(), r.tilt, r.azimuth, r.centre), r.force, r.moment.x(),
                r.moment.y()});
    return rows.table();
  }

  InsertionSetup setup_;
  InsertionOptions options_;
  cell::Cell cell_;
  InsertionArm arm_;
  Insertion insertion_;
  robot::RobotCommand last_;
  RowTable rows_;
};

}  // namespace

void InsertionSetup::validate() const {
  require(std::isfinite(clearance), "clearance: must be finite [m]");
  require(tilt > 0 && tilt < M_PI_2, "tilt: must lie between 0 and a quarter turn [rad]");
  require(offset.allFinite(), "offset: must be finite [m]");
  require(pegs >= 1, "pegs: must be at least 1");
  for (const auto& [value, name] : {std::pair{pick_distance, "pick_distance"},
                                    {repeatability, "repeatability"},
                                    {grip_error, "grip_error"},
                                    {grip_tilt, "grip_tilt"},
                                    {tube_tilt, "tube_tilt"},
                                    {face_error, "face_error"},
                                    {stiffness_error, "stiffness_error"},
                                    {servo_error, "servo_error"},
                                    {friction_error, "friction_error"},
                                    {cycle_jitter, "cycle_jitter"},
                                    {grip_force, "grip_force"},
                                    {grip_torque, "grip_torque"},
                                    {lateral_stiffness, "lateral_stiffness"}})
    require(value >= 0 && std::isfinite(value), std::string(name) + ": must not be negative");
  require(angular_stiffness > 0 && std::isfinite(angular_stiffness), "angular_stiffness: must be positive [N m/rad]");
}

InsertionResult run_insertion(const cell::Cell& cell, const InsertionSetup& setup) {
  return run_insertion(cell, setup, insertion_options(cell, setup));
}

InsertionResult run_insertion(const cell::Cell& cell, const InsertionSetup& setup,
                              const force::InsertionOptions& options) {
  setup.validate();
  check_parts(cell);
  require(setup.cycle_jitter < cell.servo->cycle, "cycle_jitter: must be less than servo.cycle of the cell [s]");
  return Task(cell, setup, options).run();
}

}  // namespace kr5::sim
