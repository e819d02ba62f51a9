// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/io/diagnostic.hpp>

namespace kr5::cell {

/// Values that no recording of this cell has. @param lines Line of each row in the file; empty: from 2 on.
void check_data(const Experiment& experiment, const Cell& cell, const std::string& file, const std::vector<int>& lines,
                std::vector<io::Diagnostic>& diagnostics);

}  // namespace kr5::cell
