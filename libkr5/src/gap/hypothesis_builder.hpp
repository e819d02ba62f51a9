// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <kr5/cell/effect.hpp>
#include <kr5/gap/hypotheses.hpp>

namespace kr5::gap {

using Point = Eigen::VectorXd;

inline Point point(std::initializer_list<double> values) {
  Point x(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), x.begin());
  return x;
}

/// Points e_1 ... e_n: an effect that is linear in its coordinates.
inline Probe unit_probe(int n, double size = 1.0) {
  Probe probe;
  for (int i = 0; i < n; ++i) probe.points.emplace_back(Point::Unit(n, i) * size);
  return probe;
}

/// Collects hypotheses of a cell.
struct HypothesisBuilder {
  const cell::Cell& cell;
  TimeSpan span;
  std::vector<Hypothesis> list;

  /// An effect with these coordinates, linear unless probes say otherwise.
  Hypothesis& add(const std::string& effect, const std::string& target, std::vector<Coordinate> coordinates,
                  std::function<void(cell::Cell&, const Point&)> apply, std::vector<Probe> probes = {}) {
    const int n = static_cast<int>(coordinates.size());
    if (probes.empty()) probes.push_back(unit_probe(n));
    list.push_back({effect, target, "", 0.0, 0.0, std::move(coordinates), std::move(probes), std::move(apply)});
    return list.back();
  }

  /// One number: the parameter stands at `off + size x`, from `lower` to `upper`.
  Hypothesis& number(const std::string& effect, const std::string& target, const std::string& parameter, double off,
                     double size, double lower = -1e12, double upper = 1e12) {
    return add(effect, target, {{(lower - off) / size, (upper - off) / size}}, [=](cell::Cell& c, const Point& x) {
      cell::set_effect(c, effect, target, parameter, cell::EffectValue(off + size * x(0)));
    });
  }
};

void add_joint_friction(HypothesisBuilder& builder, int joint);
void add_joint_drive(HypothesisBuilder& builder, int joint);
void add_joint_geometry(HypothesisBuilder& builder, int joint);
void add_couplings(HypothesisBuilder& builder);
void add_arm(HypothesisBuilder& builder);
void add_servos(HypothesisBuilder& builder);
void add_wrench(HypothesisBuilder& builder);
void add_optics(HypothesisBuilder& builder);
void add_contact(HypothesisBuilder& builder);

}  // namespace kr5::gap
