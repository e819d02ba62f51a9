// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/vision/image.hpp>

#include <algorithm>
#include <array>
#include <fstream>
#include <string_view>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/file.hpp>

namespace kr5::vision {

Image::Image(int w, int h, std::uint8_t grey) : width(w), height(h) {
  require(w > 0 && h > 0, "image: width and height must be positive [px]");
  pixels.assign(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), grey);
}

/// OpenCV reads more kinds, some by libraries that end the program on a damaged file (DICOM).
static bool is_known_kind(const std::filesystem::path& file) {
  using namespace std::string_view_literals;
  char head[4] = {};
  std::ifstream(file, std::ios::binary).read(head, sizeof head);
  const std::string_view start(head, sizeof head);
  if (head[0] == 'P' && head[1] >= '1' && head[1] <= '6') return true;
  const std::array kinds = {"\x89PNG"sv, "\xFF\xD8\xFF"sv, "II*\0"sv, "MM\0*"sv, "BM"sv};
  return std::any_of(kinds.begin(), kinds.end(), [&](std::string_view kind) { return start.starts_with(kind); });
}

Image load_image(const std::filesystem::path& file) {
  check_readable(file);
  cv::Mat m;
  try {
    if (is_known_kind(file)) m = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception& e) {
    throw IoError(file.string() + ": the image cannot be decoded: " + e.err);
  }
  if (m.empty())
    throw IoError(file.string() +
                  ": cannot be decoded as an image, or is truncated; expected PNG, JPEG, TIFF, BMP or PGM");
  Image image(m.cols, m.rows);
  for (int y = 0; y < m.rows; ++y)
    std::copy_n(m.ptr<std::uint8_t>(y), m.cols, image.pixels.begin() + static_cast<std::ptrdiff_t>(y) * m.cols);
  return image;
}

void save_image(ImageView image, const std::filesystem::path& file) {
  const cv::Mat m(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
                  static_cast<std::size_t>(image.stride));
  std::vector<std::uint8_t> bytes;
  bool good = false;
  try {
    good = cv::imencode(file.extension().string(), m, bytes);
  } catch (const cv::Exception&) {
  }
  if (!good) throw IoError(file.string() + ": the image cannot be written; is the file extension known?");
  write_file(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace kr5::vision
