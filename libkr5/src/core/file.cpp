// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/file.hpp>

#include <cerrno>
#include <fstream>
#include <random>
#include <string>
#include <system_error>

#include <kr5/core/error.hpp>

namespace kr5 {
namespace {

/// What the system said last, for the end of an error; nothing where it said nothing.
std::string last_reason() { return errno == 0 ? "" : ": " + std::generic_category().message(errno); }

}  // namespace

void check_readable(const std::filesystem::path& file) {
  using Type = std::filesystem::file_type;
  std::error_code error;
  const Type type = std::filesystem::status(file, error).type();
  if (type == Type::regular) return;
  if (type == Type::not_found) throw IoError(file.string() + ": no such file");
  if (type == Type::none)  // such as a loop of symbolic links
    throw IoError(file.string() + ": cannot be read: " + error.message());
  const char* what = type == Type::directory                          ? "a folder"
                     : type == Type::character || type == Type::block ? "a device"
                                                                      : "a pipe or a socket";
  throw IoError(file.string() + ": is " + what + ", expected a file");
}

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
    errno = 0;
    std::ofstream stream(beside, std::ios::binary | std::ios::trunc);
    stream << bytes;
    if (!stream.flush()) {
      const std::string reason = last_reason();
      if (!in_place) std::filesystem::remove(beside, error);
      throw IoError(file.string() + ": cannot be written" + reason);
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
