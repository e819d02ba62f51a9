// Any bytes as an image file: refused with IoError, or an image whose pixels are as many as its size says.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/vision/image.hpp>

using namespace kr5;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = memfd_create("fuzz", 0);  // a file that is in memory only
  if (file < 0 || write(file, data, size) != static_cast<ssize_t>(size)) std::abort();
  try {
    const vision::Image image = vision::load_image("/proc/self/fd/" + std::to_string(file));
    if (image.width <= 0 || image.height <= 0 ||
        image.pixels.size() != static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height))
      std::abort();
  } catch (const IoError&) {
  }
  close(file);
  return 0;
}
