// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/vision/family.hpp>

#include <array>

#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>

#include <kr5/core/error.hpp>
#include <kr5/geometry/marker_family.hpp>

#include "vision/markers/family_impl.hpp"

namespace kr5::vision {
namespace {

struct AprilTagFamily {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};
constexpr std::array<AprilTagFamily, 4> apriltag_families{
    {{"36h11", tag36h11_create, tag36h11_destroy},
     {"25h9", tag25h9_create, tag25h9_destroy},
     {"16h5", tag16h5_create, tag16h5_destroy},
     {"41h12", tagStandard41h12_create, tagStandard41h12_destroy}}};

struct ArucoFamily {
  const char* name;
  int number;
};
constexpr std::array<ArucoFamily, 17> aruco_families{{{"aruco_4x4_50", cv::aruco::DICT_4X4_50},
                                                      {"aruco_4x4_100", cv::aruco::DICT_4X4_100},
                                                      {"aruco_4x4_250", cv::aruco::DICT_4X4_250},
                                                      {"aruco_4x4_1000", cv::aruco::DICT_4X4_1000},
                                                      {"aruco_5x5_50", cv::aruco::DICT_5X5_50},
                                                      {"aruco_5x5_100", cv::aruco::DICT_5X5_100},
                                                      {"aruco_5x5_250", cv::aruco::DICT_5X5_250},
                                                      {"aruco_5x5_1000", cv::aruco::DICT_5X5_1000},
                                                      {"aruco_6x6_50", cv::aruco::DICT_6X6_50},
                                                      {"aruco_6x6_100", cv::aruco::DICT_6X6_100},
                                                      {"aruco_6x6_250", cv::aruco::DICT_6X6_250},
                                                      {"aruco_6x6_1000", cv::aruco::DICT_6X6_1000},
                                                      {"aruco_7x7_50", cv::aruco::DICT_7X7_50},
                                                      {"aruco_7x7_100", cv::aruco::DICT_7X7_100},
                                                      {"aruco_7x7_250", cv::aruco::DICT_7X7_250},
                                                      {"aruco_7x7_1000", cv::aruco::DICT_7X7_1000},
                                                      {"aruco_original", cv::aruco::DICT_ARUCO_ORIGINAL}}};

MarkerPattern apriltag_pattern(const std::string& family, int id) {
  const FamilyPointer f = apriltag_family_of(family);
  const std::unique_ptr<image_u8_t, void (*)(image_u8_t*)> image(apriltag_to_image(f.get(), static_cast<uint32_t>(id)),
                                                                 image_u8_destroy);
  MarkerPattern pattern{.cells = f->total_width, .square = f->width_at_border, .white = {}};
  for (int y = 0; y < image->height; ++y)
    for (int x = 0; x < image->width; ++x) pattern.white.push_back(image->buf[y * image->stride + x] > 127);
  return pattern;
}

MarkerPattern aruco_pattern(const std::string& family, int id) {
  const cv::Ptr<cv::aruco::Dictionary> d = aruco_dictionary_of(family);
  const int cells = d->markerSize + 2;
  cv::Mat image;
  d->drawMarker(id, cells, image);
  MarkerPattern pattern{.cells = cells, .square = cells, .white = {}};
  for (int y = 0; y < cells; ++y)
    for (int x = 0; x < cells; ++x) pattern.white.push_back(image.at<std::uint8_t>(y, x) > 127);
  return pattern;
}

}  // namespace

bool is_apriltag(const std::string& family) {
  for (const AprilTagFamily& f : apriltag_families)
    if (family == f.name) return true;
  return false;
}

FamilyPointer apriltag_family_of(const std::string& family) {
  for (const AprilTagFamily& f : apriltag_families)
    if (family == f.name) return FamilyPointer(f.create(), f.destroy);
  throw InvalidArgument("'" + family + "' is not an AprilTag family");
}

cv::Ptr<cv::aruco::Dictionary> aruco_dictionary_of(const std::string& family) {
  for (const ArucoFamily& f : aruco_families)
    if (family == f.name) return cv::aruco::getPredefinedDictionary(f.number);
  throw InvalidArgument("'" + family + "' is not an ArUco dictionary");
}

MarkerPattern marker_pattern(const std::string& family, int id) {
  const int count = marker_count(family);
  require(id >= 0 && id < count,
          "family " + family + " has the ids 0 to " + std::to_string(count - 1) + ", found " + std::to_string(id));
  return is_apriltag(family) ? apriltag_pattern(family, id) : aruco_pattern(family, id);
}

}  // namespace kr5::vision
