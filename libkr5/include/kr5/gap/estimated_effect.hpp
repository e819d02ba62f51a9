// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/gap/diagnosis.hpp>
#include <kr5/geometry/pose.hpp>

namespace kr5::gap {

/// An estimate as a cell takes it: a number, a vector, or a pose.
inline cell::EffectValue estimated_value(const EffectName& effect, const ParameterEstimate& p) {
  constexpr std::size_t pose = 16;
  if (p.value.size() == 1) return p.value.front();
  if (p.value.size() != pose)
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(p.value.data(), std::ssize(p.value)));
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(p.value.data());
  require(is_rotation(matrix.topLeftCorner<3, 3>()), effect.effect + "." + p.name + ": expected a pose");
  return Pose(matrix);
}

/// Sets an effect in a cell as it was estimated.
inline void set_estimates(cell::Cell& cell, const EffectName& effect,
                          const std::vector<ParameterEstimate>& parameters) {
  for (const ParameterEstimate& p : parameters)
    cell::set_effect(cell, effect.effect, effect.target, p.name, estimated_value(effect, p));
}

}  // namespace kr5::gap
