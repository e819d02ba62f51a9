// Any bytes as YAML: refused with IoError, or a tree that survives being written and read again.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include <kr5/core/error.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/view.hpp>
#include <kr5/io/fields.hpp>
#include <kr5/io/format.hpp>
#include <kr5/io/json.hpp>

using namespace kr5;

namespace {

template <class T>
void read_as(const io::Node& node) {
  T value;
  io::Reader reader("fuzz");
  if (reader.read(node, "", value)) io::to_yaml(io::to_node(value));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  io::Node node;
  try {
    node = io::parse_yaml(text, "fuzz");
  } catch (const IoError&) {
    return 0;
  }
  if (!(io::parse_yaml(io::to_yaml(node), "written") == node)) std::abort();
  io::to_json(node);
  read_as<Pinhole>(node);
  read_as<View>(node);
  return 0;
}
