// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include <kr5/io/diagnostic.hpp>

namespace kr5::cell {

struct Cell;
struct Recording;

/// Errors and warnings of a cell file, a recording (its folder or recording.yaml) or all cells and recordings below a
/// folder: form, sizes, values no real cell has, numbers that look like another unit, columns that are missing,
/// swapped, not in order of time or out of range. Empty: clean. What has errors cannot be loaded.
/// @throws IoError when `path` is not there.
std::vector<io::Diagnostic> check(const std::filesystem::path& path);

/// What `check` looks at: cell files and recording.yaml files, a recording's own cell not apart from it.
/// @throws IoError when `path` is not there.
std::vector<std::filesystem::path> find_documents(const std::filesystem::path& path);

/// The check of what is in memory; lines are those of the file it was read from.
std::vector<io::Diagnostic> check(const Cell& cell);
std::vector<io::Diagnostic> check(const Recording& recording);

}  // namespace kr5::cell
