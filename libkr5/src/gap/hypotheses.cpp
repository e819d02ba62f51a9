// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/hypotheses.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>

#include "gap/screening/row_hypothesis.hpp"

namespace kr5::gap {

using Point = Eigen::VectorXd;

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
  std::vector<Hypothesis> out;
  for (const cell::Effect& effect : cell::effect_catalogue()) {
    if (effect.periodic()) continue;
    const std::vector<std::string> targets = cell::effect_targets(effect, cell);
    for (int i = 0; i < static_cast<int>(targets.size()); ++i) {
      if (!cell::effect_possible(effect, cell, targets[i])) continue;
      for (Hypothesis& h : row_hypotheses(effect, {cell, i, 0, span.first, span.last}, targets[i]))
        out.push_back(std::move(h));
    }
  }
  return out;
}

Hypothesis own_hypothesis(const OwnEffect& own) {
  const std::string where = "effect '" + own.effect + "': ";
  require(!own.effect.empty() && !own.target.empty(), "a custom effect needs a name and a target");
  require(!own.coordinates.empty(), where + "expected at least one coordinate");
  require(own.apply || own.change, where + "expected apply (changes the cell) or change (changes the columns)");
  Hypothesis out{own, "", 0.0, own.inaccuracy, {}, {}, {}, {}};
  Point sizes(static_cast<Eigen::Index>(own.coordinates.size()));
  std::vector<double> shapes = {0.0};
  Eigen::Index shape = -1;
  for (Eigen::Index i = 0; i < sizes.size(); ++i) {
    const OwnCoordinate& c = own.coordinates[static_cast<std::size_t>(i)];
    require(!c.name.empty(), where + "a coordinate has no name");
    require(c.size > 0, where + c.name + ".size must be positive");
    require(c.lower < c.upper, where + c.name + ".lower must be below upper");
    require(!c.shapes.empty() || (c.lower <= 0 && c.upper >= 0),
            where + c.name + ": its bounds must contain 0, the off value");
    require(c.shapes.empty() || (i > 0 && shape < 0),
            where + c.name + ": only one coordinate may have shapes, and not the first");
    if (!c.shapes.empty()) {
      shape = i;
      shapes = c.shapes;
    }
    sizes(i) = c.size;
    out.coordinates.push_back(
        {c.lower / c.size, c.upper / c.size, 0.02, !c.shapes.empty(), false, c.name, c.unit, c.size});
  }
  for (const double value : shapes) {
    Probe probe;
    for (Eigen::Index i = 0; i < sizes.size(); ++i) {
      if (i == shape) continue;
      Point x = Point::Unit(sizes.size(), i);
      if (out.coordinates[static_cast<std::size_t>(i)].upper <= 0) x = -x;
      if (shape >= 0) x(shape) = value / sizes(shape);
      probe.points.push_back(x);
    }
    out.probes.push_back(std::move(probe));
  }
  if (own.apply)
    out.apply = [apply = own.apply, sizes](cell::Cell& c, const Point& x) { apply(c, sizes.cwiseProduct(x)); };
  if (own.change)
    out.change = [change = own.change, sizes](io::Table& table, const cell::Experiment& e, const Point& x) {
      change(table, e, sizes.cwiseProduct(x));
    };
  return out;
}

std::vector<PeriodicEffect> periodic_effects(const cell::Cell& cell) {
  std::vector<PeriodicEffect> out;
  for (const cell::Effect& effect : cell::effect_catalogue()) {
    if (!effect.periodic()) continue;
    const std::vector<std::string> targets = cell::effect_targets(effect, cell);
    for (int joint = 0; joint < static_cast<int>(targets.size()); ++joint)
      if (cell::effect_possible(effect, cell, targets[joint])) out.push_back({effect.id, joint});
  }
  return out;
}

Hypothesis periodic_hypothesis(const cell::Cell& cell, const PeriodicEffect& periodic, int cycles) {
  const cell::Effect& effect = cell::find_effect(periodic.effect);
  const std::string target = cell::effect_targets(effect, cell).at(static_cast<std::size_t>(periodic.joint));
  return row_hypotheses(effect, {cell, periodic.joint}, target, cycles).front();
}

Point typical_point(const Hypothesis& hypothesis) {
  return hypothesis.probes[hypothesis.probes.size() / 2].points.front();
}

cell::Cell with_typical_effect(const cell::Cell& cell, const EffectName& name, const TimeSpan& span) {
  const cell::Effect& effect = cell::find_effect(name.effect);
  const std::vector<std::string> targets = cell::effect_targets(effect, cell);
  const auto target = std::find(targets.begin(), targets.end(), name.target);
  require(target != targets.end() && cell::effect_possible(effect, cell, name.target),
          name.effect + ": this cell does not have the target '" + name.target + "'");
  const int index = static_cast<int>(target - targets.begin());
  const Hypothesis h = row_hypotheses(effect, {cell, index, 0, span.first, span.last}, name.target, 1).front();
  Point x = typical_point(h);
  for (const Point& other : h.probes[h.probes.size() / 2].points) x = x.cwiseMax(other);  // each coordinate of several
  cell::Cell out = cell;
  h.apply(out, x);
  return out;
}

}  // namespace kr5::gap
