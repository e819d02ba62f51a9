#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/effect.hpp>

/// @file
/// Effects of usual size, by their rows alone: what tests of every effect put into a cell, so that a new row needs no
/// entry in them.

namespace kr5::test {

inline double usual_size(const cell::EffectParameter& p, const cell::EffectSite& at) {
  return p.size ? p.size(at) : p.usual_size > 0 ? p.usual_size : 0.1;
}

/// A value of usual size: beside the nominal one, or from none.
inline cell::EffectValue usual_value(const cell::EffectParameter& p, const cell::EffectSite& at) {
  using Eigen::VectorXd;
  const double size = 1.7 * usual_size(p, at);
  if (p.choices && !p.choices(at).empty()) return double(p.choices(at).front().value);
  const auto nominal = p.nominal ? p.nominal(at) : std::nullopt;
  if (p.kind == cell::EffectValueKind::Pose)
    return Pose(std::get<Pose>(*nominal) *
                to_pose((Vector6() << size, -size, 0.5 * size, 0.7 * size, size, -size).finished()));
  if (p.kind == cell::EffectValueKind::Vector3) return VectorXd(size * Eigen::Vector3d(1.0, -0.6, 0.4));
  if (p.kind == cell::EffectValueKind::Vector2) return VectorXd(size * Eigen::Vector2d(1.0, -0.6));
  if (p.kind == cell::EffectValueKind::Whole) return 3.0;
  if (p.coordinate == cell::CoordinateKind::Reciprocal) return 1.0 / size;
  if (p.coordinate == cell::CoordinateKind::Logarithmic) return p.off.front();
  const double off = nominal ? std::get<double>(*nominal) : p.off.empty() ? 0.0 : p.off.front();
  return p.coordinate == cell::CoordinateKind::Ratio ? off * std::exp(size) : off + size;
}

/// Values of usual size of all parameters of an effect.
inline std::vector<std::pair<std::string, cell::EffectValue>> usual_values(const cell::Cell& cell,
                                                                           const cell::Effect& effect, int index) {
  cell::EffectSite at{.cell = cell, .index = index};
  std::vector<std::pair<std::string, cell::EffectValue>> out;
  for (const cell::EffectParameter& p : effect.parameters) {
    if (p.choices && !p.choices(at).empty()) at.choice = p.choices(at).front().value;
    out.emplace_back(p.name, usual_value(p, at));
  }
  return out;
}

/// The cell with an effect of usual size on a target.
inline void put_usual(cell::Cell& cell, const cell::Effect& effect, const std::string& target, int index) {
  for (const auto& [name, value] : usual_values(cell, effect, index))
    cell::set_effect(cell, effect.id, target, name, value);
}

}  // namespace kr5::test
