// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/io/diagnostic.hpp>

namespace kr5::cell {

/// Columns that are missing, unknown, or only part of a group. True when there are none.
bool check_columns(const Experiment& experiment, int joints, const std::string& file,
                   std::vector<io::Diagnostic>& diagnostics);

}  // namespace kr5::cell
