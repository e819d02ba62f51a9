// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string_view>

/// @file
/// Files that are whole, or not there, and that have an end.

namespace kr5 {

/// For who is about to read a file: a device or a pipe may have no end. @throws IoError naming the file where it is
/// none of regular kind or is not there.
void check_readable(const std::filesystem::path& file);

/// Writes beside the file and renames, so that a failure leaves what was there; follows links, and writes straight into
/// what is no regular file. @throws IoError naming the file and the reason.
void write_file(const std::filesystem::path& file, std::string_view bytes);

}  // namespace kr5
