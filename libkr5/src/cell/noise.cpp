// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/noise.hpp>

#include <type_traits>

namespace kr5::cell {
namespace {

/// The values of the joints, where they replace a key.
const std::vector<double>* values_of_joints(const Noise& noise, std::string_view key, int joint) {
  const std::vector<double>* own = key == "current"  ? &noise.joint_current
                                   : key == "torque" ? &noise.joint_torque
                                                     : nullptr;
  return own && joint >= 0 && !own->empty() ? own : nullptr;
}

}  // namespace

std::string Noise::field_of(std::string_view key, int joint) const {
  return (values_of_joints(*this, key, joint) ? "joint_" : "") + std::string(key);
}

double Noise::of(std::string_view key, int joint) const {
  if (const auto* own = values_of_joints(*this, key, joint)) return own->at(static_cast<std::size_t>(joint));
  double out = 0.0;
  each_field(*this, [&](const char* name, const auto& value, const char*) {
    if constexpr (std::is_same_v<std::decay_t<decltype(value)>, double>)
      if (key == name) out = value;
  });
  return out;
}

}  // namespace kr5::cell
