// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/gap/diagnosis.hpp>

/// @file
/// Causes larger than the usual errors of a model, which may be that of another robot, or than the usual errors of a
/// zero, from which the log may not count.

namespace kr5::gap {

enum class ModelWarningKind {
  Mass,  ///< `value` times that of the model.
  Size,  ///< A centre of mass, a length or an angle that lies `value` from that of the model.
  Zero,  ///< The zero of a joint, by which everything beyond it is moved.
};
constexpr auto enum_names(ModelWarningKind) {
  using enum ModelWarningKind;
  return names<ModelWarningKind>({{Mass, "mass"}, {Size, "size"}, {Zero, "zero"}});
}

struct ModelWarning : EffectName {
  ModelWarningKind kind = ModelWarningKind::Size;
  double value = 0.0;  ///< As the kind says, in `unit`.
  double std = 0.0;    ///< In `unit`.
  std::string unit;

  static void each_field(auto& self, auto&& visit) {
    EffectName::each_field(self, visit);
    visit("kind", self.kind, "What is far off: mass | size | zero.");
    visit("value", self.value, "Over that of the model for a mass, else the difference from it.");
    visit("std", self.std, "Standard deviation of the value.");
    visit("unit", self.unit, "Unit of both; - for a mass.");
  }
};

/// Causes on joints whose sizes are beyond what is usual by two standard deviations: a mass by half of it, a centre of
/// mass by 100 mm, a length by 10 mm, an angle by 0.05 rad, the zero of a joint by 0.1 rad.
/// @param cell Without the causes.
std::vector<ModelWarning> model_warnings(const Diagnosis& found, const cell::Cell& cell);

}  // namespace kr5::gap
