// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <kr5/io/node.hpp>

namespace kr5::io {

/// JSON text. Scalars that look like numbers or booleans and are not quoted are written as such; NaN and infinite
/// numbers become null. nlohmann/json is not used: it would write the digits of numbers anew, and put every number of a
/// matrix on a line of its own.
std::string to_json(const Node& node, int indent = 1);

}  // namespace kr5::io
