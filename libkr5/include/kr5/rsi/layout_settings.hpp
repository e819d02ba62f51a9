// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <kr5/rsi/telegram_layout.hpp>

/// @file
/// What the sensor configuration of a controller does not hold, as a YAML file beside it:
/// @code
/// format: kr5-rsi-settings/1
/// axes: {sign: [1, 1, -1, 1, 1, 1], zero: [0, 0, 0, 0, 0, 0]}
/// current_units: [0.5, 0.5, 0.5, 0.2, 0.2, 0.2]
/// meanings: {Force: sensor_wrench}
/// @endcode

namespace kr5::rsi {

struct LayoutSettings {
  std::string format = "kr5-rsi-settings/1";
  std::optional<ControllerAxes> axes = {};
  std::vector<double> current_units = {};  ///< [A]
  std::optional<GripperBits> gripper = {};
  std::vector<int> linear_externals = {};
  std::map<std::string, Meaning> meanings = {};

  static void each_field(auto& self, auto&& visit) {
    visit("format", self.format, "kr5-rsi-settings/1.");
    visit("axes", self.axes, "Directions and zeros of the controller's axes; none: as the joints.");
    visit("current_units", self.current_units, "Amperes of one unit of the motor current of each axis [A].");
    visit("gripper", self.gripper, "Bits of the gripper in the digital inputs and outputs; none: the usual ones.");
    visit("linear_externals", self.linear_externals, "Numbers of the external axes that are linear, from 1.");
    visit("meanings", self.meanings, "What elements mean whose names do not tell it, by their names: Force.");
  }
};

/// @throws IoError naming file, line and field.
LayoutSettings load_layout_settings(const std::filesystem::path& file);

/// The layout with these settings; what they do not hold stays.
/// @throws InvalidArgument naming the field, also for a meaning of an element that the layout does not have.
TelegramLayout with_settings(const TelegramLayout& layout, const LayoutSettings& settings);

}  // namespace kr5::rsi
