#pragma once

#include <cstdlib>
#include <filesystem>
#include <iostream>

#include <catch2/catch.hpp>

namespace kr5::test {

/// Folder or file of the reference data (KR5_REFERENCE_DIR); empty after saying so when it is not there, which is
/// allowed on a person's machine and a failure where CI is set.
inline std::filesystem::path reference(const std::string& name) {
  const char* other = std::getenv("KR5_REFERENCE_DIR");
  const std::filesystem::path path = std::filesystem::path(other ? other : KR5_REFERENCE_DIR) / name;
  if (std::filesystem::exists(path)) return path;
  if (std::getenv("CI")) FAIL("the reference data " << path << " are missing");
  std::cerr << "skipped: the reference data " << path << " are not there (set KR5_REFERENCE_DIR)\n";
  return {};
}

}  // namespace kr5::test
