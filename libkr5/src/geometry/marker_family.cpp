// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/geometry/marker_family.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include <kr5/core/error.hpp>

namespace kr5 {
namespace {

struct MarkerFamily {
  const char* name;
  int count;
};
constexpr std::array<MarkerFamily, 21> families{
    {{"36h11", 587},          {"25h9", 35},           {"16h5", 30},           {"41h12", 2115},
     {"aruco_4x4_50", 50},    {"aruco_4x4_100", 100}, {"aruco_4x4_250", 250}, {"aruco_4x4_1000", 1000},
     {"aruco_5x5_50", 50},    {"aruco_5x5_100", 100}, {"aruco_5x5_250", 250}, {"aruco_5x5_1000", 1000},
     {"aruco_6x6_50", 50},    {"aruco_6x6_100", 100}, {"aruco_6x6_250", 250}, {"aruco_6x6_1000", 1000},
     {"aruco_7x7_50", 50},    {"aruco_7x7_100", 100}, {"aruco_7x7_250", 250}, {"aruco_7x7_1000", 1000},
     {"aruco_original", 1024}}};

/// In small letters, without the words with which AprilTag and OpenCV begin their names.
std::string plain_name(const std::string& name) {
  std::string out = name;
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array<std::string_view, 8> beginnings = {"cv2.aruco.", "aruco.",   "dict_", "aruco_",
                                                          "apriltag",   "standard", "tag",   "_"};
  for (bool more = true; more;) {
    more = false;
    for (const std::string_view beginning : beginnings)
      if (out.starts_with(beginning)) out.erase(0, beginning.size()), more = true;
  }
  return out;
}

const MarkerFamily& known_family(const std::string& name) {
  const std::string plain = plain_name(name);
  for (const MarkerFamily& f : families)
    if (name == f.name || plain == plain_name(f.name)) return f;
  std::string known;
  for (const MarkerFamily& f : families) known += (known.empty() ? "" : " | ") + std::string(f.name);
  throw InvalidArgument("marker family '" + name + "' is unknown; expected " + known);
}

}  // namespace

const std::vector<std::string>& marker_families() {
  static const std::vector<std::string> all = [] {
    std::vector<std::string> list;
    for (const MarkerFamily& f : families) list.emplace_back(f.name);
    return list;
  }();
  return all;
}

std::string marker_family(const std::string& name) { return known_family(name).name; }

int marker_count(const std::string& family) { return known_family(family).count; }

}  // namespace kr5
