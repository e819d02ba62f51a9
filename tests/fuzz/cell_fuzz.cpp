// Any bytes as a cell: refused with IoError, or a cell that can be checked, and is the same when written and read
// again.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/check.hpp>
#include <kr5/core/error.hpp>

using namespace kr5;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  cell::Cell read;
  try {
    read = cell::parse_cell(std::string_view(reinterpret_cast<const char*>(data), size), "fuzz");
  } catch (const IoError&) {
    return 0;
  }
  cell::check(read);
  const std::string text = cell::to_yaml(read);
  if (cell::to_yaml(cell::parse_cell(text, "written")) != text) std::abort();
  return 0;
}
