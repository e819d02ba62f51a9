// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <string>

namespace kr5::picking {

/// A share in words: 0.93 is "93 %".
inline std::string share_text(double share) { return std::to_string(std::lround(100 * share)) + " %"; }

}  // namespace kr5::picking
