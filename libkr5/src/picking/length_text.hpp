// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sstream>
#include <string>

namespace kr5::picking {

/// A length for people: 12.3 mm.
inline std::string millimetres(double length) {
  std::ostringstream out;
  out.precision(3);
  out << 1000 * length << " mm";
  return out.str();
}

}  // namespace kr5::picking
