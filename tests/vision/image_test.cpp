#include <kr5/vision/image.hpp>

#include <filesystem>

#include <sys/stat.h>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/file.hpp>

namespace image_test {

using namespace kr5;
using Catch::Contains;

TEST_CASE("an image is read back as it was saved") {
  vision::Image image(5, 3, 17);
  image.pixels[7] = 200;
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "saved.png";
  vision::save_image(image, file);
  const vision::Image read = vision::load_image(file);
  CHECK((read.width == 5 && read.height == 3));
  CHECK(read.pixels == image.pixels);
}

TEST_CASE("what is no file or no image is refused, with its name") {
  const std::filesystem::path folder = std::filesystem::temp_directory_path(), pipe = folder / "pipe.png";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);  // to which nobody writes
  CHECK_THROWS_WITH(vision::load_image(pipe), Contains("pipe.png: is a pipe or a socket, expected a file"));
  CHECK_THROWS_WITH(vision::load_image(folder), Contains("is a folder, expected a file"));
  CHECK_THROWS_WITH(vision::load_image(folder / "none.png"), Contains("none.png: no such file"));
  write_file(folder / "text.png", "no picture");
  CHECK_THROWS_WITH(vision::load_image(folder / "text.png"), Contains("text.png: cannot be decoded as an image"));
}

}  // namespace image_test
