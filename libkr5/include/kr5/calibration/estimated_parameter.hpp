// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

/// @file
/// One number of a calibration with many parameters.

namespace kr5::calibration {

struct EstimatedParameter {
  std::string name;
  std::string unit;
  double nominal = 0.0;
  double value = 0.0;
  double std = 0.0;
  bool identifiable = true;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name, such as arm.joint2.a.");
    visit("unit", self.unit, "Unit.");
    visit("nominal", self.nominal, "Nominal value, in the unit.");
    visit("value", self.value, "Estimated value, in the unit.");
    visit("std", self.std,
          "Standard deviation of the estimate, inflated so that twice it is a 95 % interval; infinite where nothing "
          "determines the parameter, in its unit.");
    visit("identifiable", self.identifiable, "Whether the measurements alone distinguish it from the others.");
  }
};

}  // namespace kr5::calibration
