// SPDX-License-Identifier: BSD-3-Clause
#include "cell/check/values.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include <Eigen/LU>

#include <kr5/cell/effect.hpp>
#include <kr5/core/linear.hpp>

namespace kr5::cell {
namespace {

constexpr double min_mass = 1e-6;  // a tool is lighter only when it is none [kg]

/// Text of a number, when it is asked for.
auto lazy(double value) {
  return [value] { return text_of(value); };
}

void check_masses(const Cell& cell, DiagnosticCollector& c) {
  for (std::size_t i = 0; i < cell.robot.links.size(); ++i) {
    const Link& link = cell.robot.links[i];
    c.expect(link.mass >= 0, {"robot.links", static_cast<Eigen::Index>(i), ".mass"},
             "a mass that is not negative [kg]");
  }
  if (!cell.tool) return;
  const Tool& tool = *cell.tool;
  const bool any = tool.mass != 0 || !tool.com.isZero(0) || !tool.inertia.isZero(0);
  c.expect(!any || tool.mass > min_mass, "tool.mass", "a positive mass [kg], or no mass, com and inertia at all");
}

void check_gears(const Cell& cell, DiagnosticCollector& c) {
  const Gears& gears = cell.robot.gears;
  for (std::size_t i = 0; i < gears.stiffness.size(); ++i)
    c.expect(gears.stiffness[i] > 1e-6, {"robot.gears.stiffness", static_cast<Eigen::Index>(i)},
             "a positive stiffness [N m/rad or N/m]", lazy(gears.stiffness[i]));
  c.expect(gears.elastic_damping >= 0, "robot.gears.elastic_damping", "a damping ratio, not negative [-]");
  c.expect(gears.backlash_damping >= 0, "robot.gears.backlash_damping", "a damping ratio, not negative [-]");
  c.expect(gears.side_torque >= 0, "robot.gears.side_torque", "a load, not negative [N m or N]");
}

constexpr double slowest = 1e-4;  // a slower joint takes hours for a motion of any use [rad/s or m/s]

void check_limits(const Cell& cell, DiagnosticCollector& c) {
  if (!cell.robot.limits) return;
  const Limits& limits = *cell.robot.limits;
  for (Eigen::Index i = 0; i < limits.lower.size(); ++i)
    c.expect(std::isinf(limits.lower[i]) == std::isinf(limits.upper[i]), {"robot.limits.upper", i},
             "two finite limits, or -.inf and .inf for a joint that turns without end", lazy(limits.upper[i]));
  for (Eigen::Index i = 0; i < limits.lower.size(); ++i)
    c.expect(
        limits.lower[i] < limits.upper[i], {"robot.limits.lower", i},
        [&] { return "less than the upper limit " + text_of(limits.upper[i]) + "; are lower and upper swapped?"; },
        lazy(limits.lower[i]));
  for (Eigen::Index i = 0; i < limits.velocity.size(); ++i)
    c.expect(
        limits.velocity[i] >= slowest, {"robot.limits.velocity", i},
        [&] { return "a positive speed of at least " + text_of(slowest) + " rad/s or m/s"; }, lazy(limits.velocity[i]));
  for (Eigen::Index i = 0; i < limits.effort.size(); ++i)
    c.expect(limits.effort[i] > 1e-6, {"robot.limits.effort", i}, "a positive torque or force [N m or N]");
}

bool invertible(const Eigen::MatrixXd& S) {
  constexpr double least = 1e-9;  // smallest over greatest singular value
  // The norms bound that from below, for a part of what the singular values cost.
  if (S.norm() * S.inverse().norm() < 0.5 / least) return true;
  const Eigen::VectorXd s = singular_values(S);
  return s.minCoeff() > least * s.maxCoeff();
}

void check_drives(const Cell& cell, DiagnosticCollector& c) {
  if (!cell.drives) return;
  const Drives& d = *cell.drives;
  c.expect(invertible(d.structure), "drives.structure",
           "an invertible matrix, so that motor angles determine joint angles", "a singular matrix");
  for (Eigen::Index i = 0; i < d.rotor_inertia.size(); ++i) {
    c.expect(d.rotor_inertia[i] >= 0, {"drives.rotor_inertia", i}, "an inertia, not negative [kg m^2]");
    c.expect(d.torque_constant[i] > 1e-6, {"drives.torque_constant", i}, "a positive torque constant [N m/A]");
    c.expect(d.friction.coulomb[i] >= 0, {"drives.friction.coulomb", i}, "a friction level, not negative [N m]");
    c.expect(d.friction.viscous[i] >= 0, {"drives.friction.viscous", i}, "a slope, not negative [N m s/rad]");
  }
}

/// @param index Of a list of loops; -1: one for all.
void check_servo_loop(DiagnosticCollector& c, const std::string& field, Eigen::Index index, const SecondOrder& s) {
  const auto expect = [&](bool good, const char* name, const char* expected) {
    if (!good) c.add((index < 0 ? field : item(field, index)) + name, expected);
  };
  expect(s.natural_frequency >= 1e-3, ".natural_frequency", "a positive frequency [rad/s]");
  expect(s.damping_ratio >= 1e-3 && s.damping_ratio <= 1e3, ".damping_ratio", "a positive damping ratio [-]");
  expect(s.delay >= 0, ".delay", "a delay, not negative [s]");
}

void check_torque_servo(DiagnosticCollector& c, const FieldPath& field, const TorqueServo& s) {
  const auto expect = [&](bool good, const char* name, const char* expected) {
    if (!good) c.add(field.text() + name, expected);
  };
  expect(s.stiffness >= 0, ".stiffness", "a stiffness, not negative [N m/rad or N/m]");
  expect(s.damping >= 0, ".damping", "a damping, not negative [N m s/rad or N s/m]");
  expect(s.integral >= 0, ".integral", "a gain, not negative [N m/(rad s) or N/(m s)]");
  expect(s.dead_band >= 0, ".dead_band", "an error of the position, not negative [rad or m]");
  expect(s.torque_limit.value_or(1.0) > 1e-9, ".torque_limit", "a positive torque or force [N m or N]");
  expect(s.stall_torque.value_or(1.0) > 1e-9, ".stall_torque", "a positive torque or force [N m or N]");
  expect(s.no_load_speed.value_or(1.0) > 1e-6, ".no_load_speed", "a positive speed [rad/s or m/s]");
  expect(s.stall_torque.has_value() == s.no_load_speed.has_value(), ".no_load_speed",
         "stall_torque and no_load_speed together, or none of them");
  expect(s.torque_dead_band >= 0, ".torque_dead_band", "a torque or force, not negative [N m or N]");
  expect(s.delay >= 0, ".delay", "a delay, not negative [s]");
}

void check_servo(const Cell& cell, DiagnosticCollector& c) {
  if (!cell.servo) return;
  const Servo& servo = *cell.servo;
  c.expect(servo.cycle >= 1e-5, "servo.cycle", "a period of at least 1e-5 s");
  for (std::size_t i = 0; i < servo.joint.size(); ++i)
    check_servo_loop(c, "servo.joint", servo.joint.size() == 1 ? -1 : static_cast<Eigen::Index>(i), servo.joint[i]);
  for (std::size_t i = 0; i < servo.torque.size(); ++i)
    check_torque_servo(c, {"servo.torque", servo.torque.size() == 1 ? -1 : static_cast<Eigen::Index>(i)},
                       servo.torque[i]);
  if (servo.tool) check_servo_loop(c, "servo.tool", -1, *servo.tool);
  if (!servo.correction) return;
  c.expect(servo.correction->per_cycle.value_or(1.0) > 1e-9, "servo.correction.per_cycle", "a positive length [m]");
  c.expect(servo.correction->total.value_or(1.0) > 1e-9, "servo.correction.total", "a positive length [m]");
}

constexpr double min_length = 1e-6;  // [m]

void check_sensors(const Cell& cell, DiagnosticCollector& c) {
  if (const auto& camera = cell.camera) {
    c.expect(camera->width > 0, "camera.width", "a positive number of pixels");
    c.expect(camera->height > 0, "camera.height", "a positive number of pixels");
    c.expect(camera->fx > 0, "camera.fx", "a positive focal length [px]");
    c.expect(camera->fy > 0, "camera.fy", "a positive focal length [px]");
    c.expect(camera->cx >= 0 && camera->cx <= camera->width, "camera.cx", "a principal point inside the image [px]");
    c.expect(camera->cy >= 0 && camera->cy <= camera->height, "camera.cy", "a principal point inside the image [px]");
  }
  if (cell.board)
    for (const TargetProblem& p : cell.board->target().problems())
      c.add("board." + (p.field == "size" ? "marker" : p.field), p.expected, p.found);
  for (std::size_t i = 0; i < cell.targets.size(); ++i)
    for (const TargetProblem& p : cell.targets[i].problems())
      c.add(item("targets", static_cast<Eigen::Index>(i)) + "." + p.field, p.expected, p.found);
  if (cell.laser) {
    c.expect(cell.laser->stand_off >= 0, "laser.stand_off", "a range, not negative [m]");
    c.expect(cell.laser->bias_distance > min_length, "laser.bias_distance", "a positive length [m]");
  }
  if (cell.laser && cell.laser->target)
    c.expect(cell.laser->target->radius > min_length, "laser.target.radius", "a positive radius [m]");
  constexpr double min_noise = 1e-12;
  const auto joints = static_cast<std::size_t>(cell.robot.joints());
  Noise::each_field(cell.noise, [&](const char* name, const auto& value, const char*) {
    const std::string field = std::string("noise.") + name;
    if constexpr (std::is_same_v<std::decay_t<decltype(value)>, double>) {
      c.expect(value == 0 || value >= min_noise, field, "a positive standard deviation, or 0 for an absent sensor");
    } else {
      c.expect(value.empty() || value.size() == joints, field, std::to_string(joints) + " values, one a joint");
      for (const double one : value) c.expect(one >= min_noise, field, "a positive standard deviation of each joint");
    }
  });
}

void check_task(const Cell& cell, DiagnosticCollector& c) {
  if (const auto& contact = cell.contact) {
    c.expect(contact->stiffness >= 1, "contact.stiffness", "a stiffness of at least 1 N/m");
    c.expect(contact->damping >= 0, "contact.damping", "a damping, not negative [N s/m]");
    c.expect(contact->friction >= 0, "contact.friction", "a friction coefficient, not negative");
  }
  if (const auto& peg = cell.peg) {
    c.expect(peg->radius > min_length, "peg.radius", "a positive radius [m]");
    c.expect(peg->length > min_length, "peg.length", "a positive length [m]");
    c.expect(peg->chamfer >= 0 && peg->chamfer < peg->radius, "peg.chamfer", "a width between 0 and the radius [m]");
  }
  if (const auto& tube = cell.tube) {
    c.expect(tube->inner_radius > min_length, "tube.inner_radius", "a positive radius [m]");
    c.expect(tube->outer_radius > tube->inner_radius, "tube.outer_radius",
             [&] { return "more than the inner radius " + text_of(tube->inner_radius) + " m"; });
    c.expect(tube->depth > min_length, "tube.depth", "a positive depth [m]");
    c.expect(tube->chamfer >= 0 && tube->chamfer < tube->outer_radius, "tube.chamfer",
             "a width between 0 and the outer radius [m]");
    c.expect(!cell.peg || cell.peg->radius <= tube->inner_radius, "peg.radius", [&] {
      return "no more than the inner radius of the tube, " + text_of(tube->inner_radius) +
             " m; a wider peg does not fit";
    });
  }
}

void check_bounds(const Cell& cell, DiagnosticCollector& c) {
  for (const ActiveEffect& active : active_effects(cell.effects)) {
    const Effect& effect = find_effect(active.id);
    for (const auto& [name, value] : active.parameters) {
      const auto p = std::find_if(effect.parameters.begin(), effect.parameters.end(),
                                  [&name = name](const EffectParameter& q) { return q.name == name; });
      const bool unlimited = !p->off.empty() && std::isinf(p->off.front());  // such as a stiffness that is off
      const auto inside = [&](double x) {
        return x >= p->lower && x <= p->upper && (std::isfinite(x) ? std::abs(x) <= 1e12 : unlimited);
      };
      bool good = true;
      if (const auto* x = std::get_if<double>(&value)) good = inside(*x);
      if (const auto* T = std::get_if<Pose>(&value))
        good = T->matrix().allFinite() && T->translation().cwiseAbs().maxCoeff() <= 1e3;
      if (const auto* v = std::get_if<Eigen::VectorXd>(&value)) good = std::all_of(v->begin(), v->end(), inside);
      if (good) continue;
      c.add("effects." + active.id + "." + active.target + "." + name,
            text_of(p->lower) + " to " + text_of(p->upper) + " " + p->unit);
    }
  }
}

}  // namespace

void check_values(const Cell& cell, DiagnosticCollector& c) {
  check_masses(cell, c);
  check_gears(cell, c);
  check_limits(cell, c);
  check_drives(cell, c);
  check_servo(cell, c);
  check_sensors(cell, c);
  check_task(cell, c);
  check_bounds(cell, c);
}

}  // namespace kr5::cell
