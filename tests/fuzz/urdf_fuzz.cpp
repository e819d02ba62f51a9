// Any bytes as URDF: refused with IoError, or a cell. What of it can be written as URDF can be read again.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include <kr5/cell/export_urdf.hpp>
#include <kr5/cell/import_urdf.hpp>
#include <kr5/core/error.hpp>

using namespace kr5;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  cell::UrdfImport read;
  try {
    read = cell::parse_urdf(std::string_view(reinterpret_cast<const char*>(data), size), "fuzz");
  } catch (const IoError&) {
    return 0;
  }
  std::string xml;
  try {
    xml = cell::to_urdf(read.cell);
  } catch (const InvalidArgument&) {  // a slide without limits
    return 0;
  }
  cell::parse_urdf(xml, "written");
  return 0;
}
