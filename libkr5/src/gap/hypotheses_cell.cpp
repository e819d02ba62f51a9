// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>

#include "gap/hypothesis_builder.hpp"
#include "gap/sizes.hpp"

namespace kr5::gap {
namespace {

using cell::Cell;
using cell::EffectValue;
using cell::set_effect;

constexpr std::array<const char*, 6> components = {"fx", "fy", "fz", "tx", "ty", "tz"};

/// A mount: translation and rotation vector on the right of the nominal one.
void add_mount(HypothesisBuilder& b, const std::string& effect, const std::string& target, const std::string& name,
               const Pose& nominal) {
  b.add(effect, target, std::vector<Coordinate>(6), [=](Cell& c, const Point& x) {
    Vector6 d;
    d << x.head<3>() * sizes::length, x.tail<3>() * sizes::angle;
    set_effect(c, effect, target, name, EffectValue(Pose(nominal * to_pose(d))));
  });
}

/// A vector from `size x`.
void add_vector(HypothesisBuilder& b, const std::string& effect, const std::string& target, const std::string& name,
                int n, double size) {
  b.add(effect, target, std::vector<Coordinate>(static_cast<std::size_t>(n)),
        [=](Cell& c, const Point& x) { set_effect(c, effect, target, name, EffectValue(Eigen::VectorXd(size * x))); });
}

/// Two numbers that replace nominal ones.
void add_two(HypothesisBuilder& b, const std::string& effect, const std::string& target,
             const std::array<const char*, 2>& names, const std::array<double, 2>& off,
             const std::array<double, 2>& size, double lower) {
  std::vector<Coordinate> coordinates;
  for (int i = 0; i < 2; ++i) coordinates.push_back({(lower - off[i]) / size[i]});
  b.add(effect, target, std::move(coordinates), [=](Cell& c, const Point& x) {
    for (int i = 0; i < 2; ++i) set_effect(c, effect, target, names[i], EffectValue(off[i] + size[i] * x(i)));
  });
}

/// Relative change of something positive: off exp(part x).
void add_ratio(HypothesisBuilder& b, const std::string& effect, const std::string& target, const std::string& name,
               double off) {
  b.add(effect, target, {{-20.0, 20.0}},
        [=](Cell& c, const Point& x) {
          set_effect(c, effect, target, name, EffectValue(off * std::exp(sizes::part * x(0))));
        },
        {unit_probe(1, 1.0), unit_probe(1, -1.0)});
}

/// A delay that acts in whole cycles.
void add_cycles(HypothesisBuilder& b, const std::string& effect, const std::string& target, double nominal,
                double cycle) {
  b.add(effect, target, {{-std::round(nominal / cycle), 40.0, 1.0, false, true}},
        [=](Cell& c, const Point& x) {
          set_effect(c, effect, target, "delay", EffectValue(std::max(nominal + cycle * std::round(x(0)), 0.0)));
        },
        {unit_probe(1, 1.0), unit_probe(1, 4.0)});
}

}  // namespace

void add_arm(HypothesisBuilder& b) {
  const double span = std::max(b.span.last - b.span.first, 1.0);
  b.add("base_tilt", "base", {{}, {}}, [](Cell& c, const Point& x) {
    set_effect(c, "base_tilt", "base", "roll", EffectValue(sizes::angle * x(0)));
    set_effect(c, "base_tilt", "base", "pitch", EffectValue(sizes::angle * x(1)));
  });
  std::vector<Probe> warm;
  for (const double part : {0.1, 0.5, 3.0}) warm.push_back({{point({1.0, std::log(part * span)})}});
  b.add(
      "thermal_growth", "links", {{}, {std::log(span / 100), std::log(30 * span), 0.05, true}},
      [](Cell& c, const Point& x) {
        set_effect(c, "thermal_growth", "links", "growth", EffectValue(5e-4 * x(0)));
        set_effect(c, "thermal_growth", "links", "time_constant", EffectValue(std::exp(x(1))));
      },
      std::move(warm));
  if (!b.cell.tool) return;
  add_vector(b, "tool_offset", "tool", "offset", 3, sizes::length);
  // Linear in mass and first moment.
  const double mass = sizes::scale * std::max(b.cell.tool->mass, 1.0);
  std::vector<Point> points = {point({1, 0, 0, 0}), point({1, 1, 0, 0}), point({1, 0, 1, 0}), point({1, 0, 0, 1})};
  b.add("payload", "tool", {{1e-3}, {}, {}, {}},
        [=](Cell& c, const Point& x) {
          const Eigen::VectorXd com = (0.1 * x.tail<3>() / std::max(x(0), 1e-3)).cwiseMax(-5.0).cwiseMin(5.0);
          set_effect(c, "payload", "tool", "mass", EffectValue(mass * x(0)));
          set_effect(c, "payload", "tool", "com", EffectValue(com));
        },
        {{std::move(points)}});
}

void add_servos(HypothesisBuilder& b) {
  const cell::Servo& servo = *b.cell.servo;
  if (!servo.joint.empty()) {
    for (int joint = 0; joint < b.cell.robot.joints(); ++joint)
      add_ratio(b, "joint_servo", "joint" + std::to_string(joint + 1), "natural_frequency",
                servo.of_joint(joint).natural_frequency);
    b.number("joint_delay", "drives", "delay", servo.of_joint(0).delay, sizes::half_cycle, 0.0);
  }
  if (b.cell.drives) b.number("current_delay", "drives", "delay", 0.0, sizes::half_cycle, 0.0);
  if (!servo.tool) return;
  add_ratio(b, "tool_servo", "servo", "natural_frequency", servo.tool->natural_frequency);
  add_ratio(b, "tool_damping", "servo", "damping_ratio", servo.tool->damping_ratio);
  add_cycles(b, "tool_delay", "servo", servo.tool->delay, servo.cycle > 0 ? servo.cycle : 0.012);
}

void add_wrench(HypothesisBuilder& b) {
  const double span = std::max(b.span.last, 1.0);
  for (int i = 0; i < 6; ++i) {
    const double noise = sizes::wrench_noise(b.cell, i);
    b.number("ft_bias", components[i], "bias", 0.0, 5 * noise);
    b.number("ft_drift", components[i], "rate", 0.0, 5 * noise / span);
    b.number("ft_gain", components[i], "gain", 1.0, sizes::scale, 0.0);
    for (int source = 0; source < 6; ++source) {
      if (source == i) continue;
      const std::string at = components[i];
      const double size = sizes::scale * noise / sizes::wrench_noise(b.cell, source);
      Hypothesis& h = b.add("ft_crosstalk", at, {{}}, [=](Cell& c, const Point& x) {
        set_effect(c, "ft_crosstalk", at, "source", EffectValue(static_cast<double>(source)));
        set_effect(c, "ft_crosstalk", at, "gain", EffectValue(size * x(0)));
      });
      h.choice = std::string("from ") + components[source];
      h.log_prior = -std::log(5.0);
    }
  }
  b.add("ft_lag", "force_torque", {{0.0, 10.0 / sizes::half_cycle, 0.1}},
        [](Cell& c, const Point& x) {
          set_effect(c, "ft_lag", "force_torque", "time_constant", EffectValue(sizes::half_cycle * x(0)));
        },
        {unit_probe(1, 2.0), unit_probe(1, 8.0)});
}

void add_optics(HypothesisBuilder& b) {
  const Pose T_E_F = b.cell.tool ? b.cell.tool->T_F_E.inverse() : Pose::Identity();
  if (b.cell.camera) {
    const cell::Camera& camera = *b.cell.camera;
    const Pinhole nominal = camera.pinhole();
    add_two(b, "camera_focal", "camera", {"fx", "fy"}, {camera.fx, camera.fy}, {2e-3 * camera.fx, 2e-3 * camera.fy},
            1.0);
    add_two(b, "lens_distortion", "camera", {"k1", "k2"}, {nominal.k1, nominal.k2}, {0.01, 0.02}, -100.0);
    if (const auto T = cell::T_F_C(b.cell)) add_mount(b, "hand_eye", "camera", "T_E_C", T_E_F * *T);
  }
  if (b.cell.laser) {
    if (const auto T = cell::T_F_L(b.cell)) add_mount(b, "laser_mount", "laser", "T_E_L", T_E_F * *T);
    b.number("laser_bias", "laser", "bias", 0.0, 2e-4, -0.1, 0.1);
    b.number("laser_lag", "laser", "lag", 0.0, sizes::half_cycle, -1.0, 1.0);
  }
}

void add_contact(HypothesisBuilder& b) {
  const cell::Contact& contact = *b.cell.contact;
  add_ratio(b, "contact_stiffness", "contact", "stiffness", contact.stiffness);
  b.number("contact_hardening", "contact", "hardening", 0.0, sizes::part, -10.0);
  b.number("contact_friction", "contact", "friction", contact.friction, sizes::part * std::max(contact.friction, 0.1),
           0.0);
  const double compliance = sizes::part / contact.stiffness;
  add_two(b, "gripper_compliance", "gripper", {"lateral", "axial"}, {0.0, 0.0}, {compliance, compliance}, 0.0);
  if (!b.cell.tube) return;
  add_vector(b, "tube_tilt", "tube", "tilt", 2, 10 * sizes::angle);
  add_vector(b, "tube_shift", "tube", "shift", 3, 0.3 * sizes::length);
  const double bore = b.cell.tube->inner_radius;
  b.number("tube_radius", "tube", "inner_radius", bore, 0.01 * bore, 0.1 * bore);
}

}  // namespace kr5::gap
