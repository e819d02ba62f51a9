// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/linked_options.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include <kr5/core/error.hpp>

#include "work/servo_lead.hpp"

namespace kr5::work {
namespace {

constexpr int answers_missed = 10;       // in succession; the schema of KUKA's signal flow has as many
constexpr double longest = 1.9;          // a correction that a controller takes [m]
constexpr double longest_silence = 0.5;  // silence after which a session is over [s]

/// All places that the tool goes to.
Eigen::AlignedBox3d places(const WorkOptions& o) {
  Eigen::AlignedBox3d out;
  for (const Pose* T : {&o.job.places.T_base_scan, &o.job.places.T_base_scan_end, &o.job.places.T_base_tube,
                        &o.T_base_lying_seat, &o.T_base_standing_seat})
    out.extend(T->translation());
  for (const double x : {-0.5, 0.5})
    for (const double y : {-0.5, 0.5})
      for (const double z : {0.0, 1.0})
        out.extend(o.bin.T_base_bin * o.bin.size.cwiseProduct(Eigen::Vector3d(x, y, z)));
  Eigen::Vector3d high = out.max();
  high.z() = std::max(high.z(), o.job.places.travel_height);
  out.extend(high);
  return out;
}

/// Limits of what a lead makes of a motion.
rsi::MotionLimits led(double speed, double acceleration, double way, const robot::ServoFeedforward& lead,
                      double cycle) {
  const double ahead = lead(speed, acceleration);
  rsi::MotionLimits out;
  out.speed = speed + 2 * ahead / cycle;
  out.acceleration = 2 * out.speed / cycle;
  out.total = way + ahead;
  return out;
}

}  // namespace

void LinkedOptions::validate() const {
  layout.validate();
  link.validate();
  emulator.validate();
  const rsi::EmulationOptions& controller = emulator.controller;
  require(link.mode == controller.mode, "link.mode: is not that of the controller, emulator.controller.mode");
  require(link.frame == controller.frame, "link.frame: is not that of the controller, emulator.controller.frame");
  require(std::abs(link.cycle - controller.rules.cycle) < 1e-6,
          "link.cycle: is not that of the controller, emulator.controller.rules.cycle [s]");
}

LinkedOptions linked_options(const WorkOptions& options, const cell::Cell& believed, rsi::Controller controller) {
  options.validate();
  const robot::ServoFeedforward lead = servo_lead(believed);
  const job::PathLimits& motion = options.job.motion;
  const double cycle = options.job.cycle;
  LinkedOptions out;
  out.layout = rsi::job_layout(controller);
  out.layout.address = "127.0.0.1";
  out.layout.current_units.assign(6, 1.0);
  out.link.listen = out.layout.address;
  out.link.cycle = cycle;
  out.link.silence = longest_silence;
  out.link.limits.translation = led(motion.speed, motion.acceleration, places(options).sizes().maxCoeff(), lead, cycle);
  require(out.link.limits.translation.total < longest,
          "job.places: the tool goes farther than a correction may be, 1.9 m; move bin, stand and tube together, or "
          "lower job.motion.speed and acceleration");
  out.link.limits.rotation = led(motion.turning_speed, motion.turning_acceleration, std::numbers::pi, lead, cycle);
  rsi::ControllerRules& rules = out.emulator.controller.rules;
  rules = rsi::usual_rules(controller);
  const double share = rules.answer_time / rules.cycle;
  rules.cycle = cycle;
  rules.answer_time = share * cycle;
  rules.max_late = std::min(rules.max_late, answers_missed);
  rules.translation_limit = out.link.limits.translation.total;
  rules.rotation_limit = std::numbers::pi;
  out.emulator.controller.count_from = rsi::CountFrom::Answer;
  out.validate();
  return out;
}

rsi::ProgramOptions program_options(const LinkedOptions& options) {
  const rsi::EmulationOptions& controller = options.emulator.controller;
  rsi::ProgramOptions out;
  out.name = "kr5_job";
  out.mode = controller.mode;
  out.frame = controller.frame;
  out.cycle = controller.rules.cycle;
  out.timeout = controller.rules.max_late;
  out.translation_limit = controller.rules.translation_limit;
  out.rotation_limit = controller.rules.rotation_limit;
  return out;
}

}  // namespace kr5::work
