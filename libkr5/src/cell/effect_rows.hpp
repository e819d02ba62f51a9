// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/effect.hpp>

/// @file
/// The catalogue with the way to each parameter's place in Effects.

namespace kr5::cell {

template <class... T>
using PointerTo = std::variant<T*...>;
using Slot = PointerTo<double, std::optional<double>, int, Eigen::Vector2d, Eigen::Vector3d, std::optional<Pose>>;
using ConstSlot = PointerTo<const double, const std::optional<double>, const int, const Eigen::Vector2d,
                            const Eigen::Vector3d, const std::optional<Pose>>;

/// Place of one parameter; the index (from 0) is that of a joint, motor or wrench component.
struct SlotAccess {
  Slot (*write)(Effects&, int) = nullptr;
  ConstSlot (*read)(const Effects&, int) = nullptr;
};

struct EffectRow {
  Effect effect;
  std::vector<SlotAccess> slots;  ///< One a parameter.
};

const std::vector<EffectRow>& effect_rows();
/// The row of an effect, or null.
const EffectRow* find_row(const std::string& id);
/// Index of a target such as `joint3` (2), `fx` (0) or `camera` (0) for an effect of this kind; -1 when it is none.
int target_index(EffectTarget kind, const std::string& target);
std::string target_name(EffectTarget kind, int index);
/// `joint<k>`, `fx | fy | ...`, `camera`: for messages.
std::string target_text(EffectTarget kind);

std::optional<EffectValue> read_slot(const ConstSlot& slot);
/// Whether two slots of one parameter hold the same.
bool same_slot(const ConstSlot& a, const ConstSlot& b);

}  // namespace kr5::cell
