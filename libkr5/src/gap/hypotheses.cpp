// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/hypotheses.hpp>

#include <algorithm>
#include <cmath>

#include "gap/hypothesis_builder.hpp"
#include "gap/sizes.hpp"

namespace kr5::gap {

TimeSpan span_of(const cell::Recording& recording) {
  TimeSpan out{0.0, 0.0};
  for (const cell::Experiment& e : recording.experiments) {
    const int t = e.data.find("t");
    if (t < 0 || e.data.values.rows() == 0) continue;
    out.first = std::min(out.first, e.data.values.col(t).minCoeff());
    out.last = std::max(out.last, e.data.values.col(t).maxCoeff());
  }
  return out;
}

std::vector<Hypothesis> hypotheses(const cell::Cell& cell, const TimeSpan& span) {
  HypothesisBuilder builder{cell, span, {}};
  for (int joint = 0; joint < cell.robot.joints(); ++joint) {
    if (cell.drives) {
      add_joint_friction(builder, joint);
      add_joint_drive(builder, joint);
    }
    add_joint_geometry(builder, joint);
  }
  if (cell.drives) add_couplings(builder);
  add_arm(builder);
  if (cell.servo) add_servos(builder);
  if (cell.tool) add_wrench(builder);
  add_optics(builder);
  if (cell.contact) add_contact(builder);
  return std::move(builder.list);
}

Hypothesis periodic_hypothesis(const cell::Cell& cell, const std::string& effect, int joint, int cycles) {
  const bool ripple = effect == "torque_ripple";
  const double size = ripple ? sizes::part * sizes::friction(cell, joint) : sizes::angle / 2;
  const std::string target = "joint" + std::to_string(joint + 1);
  HypothesisBuilder builder{cell, {}, {}};
  Hypothesis& h = builder.add(effect, target, {{}, {}}, [=](cell::Cell& c, const Point& x) {
    cell::set_effect(c, effect, target, "amplitude", cell::EffectValue(size * x.norm()));
    cell::set_effect(c, effect, target, "cycles", cell::EffectValue(static_cast<double>(cycles)));
    cell::set_effect(c, effect, target, "phase", cell::EffectValue(std::atan2(x(1), x(0))));
  });
  h.choice = std::to_string(cycles) + (cycles == 1 ? " cycle" : " cycles");
  return h;
}

}  // namespace kr5::gap
