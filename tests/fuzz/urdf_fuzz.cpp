// Any bytes as URDF: refused with IoError, or a cell. What of it can be written as URDF, anew or in place, can be read
// again.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include <kr5/cell/export_urdf.hpp>
#include <kr5/cell/import_urdf.hpp>
#include <kr5/cell/update_urdf.hpp>
#include <kr5/core/error.hpp>

using namespace kr5;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  cell::UrdfImport read;
  try {
    read = cell::parse_urdf(std::string_view(reinterpret_cast<const char*>(data), size), "fuzz");
  } catch (const IoError&) {
    return 0;
  }
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  cell::Cell changed = read.cell;
  changed.drives = cell::unit_drives(changed.robot.joints());
  changed.drives->friction.coulomb.setConstant(0.5);
  for (cell::Link& link : changed.robot.links) link.mass *= 1.1;
  try {
    cell::parse_urdf(cell::update_urdf(text, "fuzz", changed).xml, "updated");
  } catch (const IoError&) {  // masses of which no real body is left
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
