// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace kr5::rsi {

/// A number of a file of the controller, rounded to four decimals, without zeros at its end.
std::string number_text(double value);

}  // namespace kr5::rsi
