#pragma once

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

#include <catch2/catch.hpp>

namespace kr5::test {

/// Folder or file of the reference data (KR5_REFERENCE_DIR). Where it is not there the test ends: it fails in CI, and
/// on a person's machine ctest counts it as skipped, by these words.
inline std::filesystem::path reference(const std::string& name) {
  const char* other = std::getenv("KR5_REFERENCE_DIR");
  const std::filesystem::path path = std::filesystem::path(other ? other : KR5_REFERENCE_DIR) / name;
  if (std::filesystem::exists(path)) return path;
  if (std::getenv("CI")) FAIL("the reference data " << path << " are missing");
  throw std::runtime_error("skipped: no reference data " + path.string() + " (set KR5_REFERENCE_DIR)");
}

}  // namespace kr5::test
