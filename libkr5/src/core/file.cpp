// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/file.hpp>

#include <fstream>
#include <random>
#include <string>

#include <kr5/core/error.hpp>

namespace kr5 {

void write_file(const std::filesystem::path& file, std::string_view bytes) {
  std::error_code error;
  std::filesystem::path target = file;
  for (int links = 0; links < 40 && std::filesystem::is_symlink(target, error); ++links) {
    const std::filesystem::path next = std::filesystem::read_symlink(target, error);
    if (error) break;
    target = target.parent_path() / next;
  }
  const std::filesystem::file_status status = std::filesystem::status(target, error);
  if (std::filesystem::is_symlink(target, error))
    throw IoError(file.string() + ": cannot be written: the link is circular");
  const bool in_place =
      std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);  // a device, a pipe
  std::filesystem::path beside = target;
  if (!in_place) beside += "." + std::to_string(std::random_device()()) + ".part";
  {
    std::ofstream stream(beside, std::ios::binary | std::ios::trunc);
    stream << bytes;
    if (!stream.flush()) {
      if (!in_place) std::filesystem::remove(beside, error);
      throw IoError(file.string() + ": cannot be written");
    }
  }
  if (in_place) return;
  std::filesystem::rename(beside, target, error);
  if (error) {
    const std::string why = error.message();
    std::filesystem::remove(beside, error);
    throw IoError(file.string() + ": cannot be written: " + why);
  }
}

}  // namespace kr5
