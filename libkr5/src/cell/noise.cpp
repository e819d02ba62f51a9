// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/noise.hpp>

#include <type_traits>

namespace kr5::cell {

double Noise::of(std::string_view key, int joint) const {
  const std::vector<double>* own = key == "current" ? &joint_current : key == "torque" ? &joint_torque : nullptr;
  if (own && joint >= 0 && !own->empty()) return own->at(static_cast<std::size_t>(joint));
  double out = 0.0;
  each_field(*this, [&](const char* name, const auto& value, const char*) {
    if constexpr (std::is_same_v<std::decay_t<decltype(value)>, double>)
      if (key == name) out = value;
  });
  return out;
}

}  // namespace kr5::cell
