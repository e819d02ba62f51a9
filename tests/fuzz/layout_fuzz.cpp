// Any bytes as the sensor configuration of a controller: refused with IoError, or a layout that reads back.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include <kr5/core/error.hpp>
#include <kr5/rsi/layout_file.hpp>

using namespace kr5;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const rsi::TelegramLayout layout =
        rsi::parse_layout(std::string_view(reinterpret_cast<const char*>(data), size), "fuzz");
    const std::string text = rsi::layout_xml(layout);
    if (rsi::layout_xml(rsi::parse_layout(text, "written")) != text) std::abort();
  } catch (const IoError&) {
  } catch (const InvalidArgument&) {  // a text that is not written
  }
  return 0;
}
