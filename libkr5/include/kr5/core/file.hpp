// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string_view>

/// @file
/// Files that are whole, or not there.

namespace kr5 {

/// Writes beside the file and renames, so that a failure leaves what was there; follows links, and writes straight into
/// what is no regular file. @throws IoError naming the file.
void write_file(const std::filesystem::path& file, std::string_view bytes);

}  // namespace kr5
