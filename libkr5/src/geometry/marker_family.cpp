// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/geometry/marker_family.hpp>

#include <array>

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

}  // namespace

const std::vector<std::string>& marker_families() {
  static const std::vector<std::string> all = [] {
    std::vector<std::string> list;
    for (const MarkerFamily& f : families) list.emplace_back(f.name);
    return list;
  }();
  return all;
}

int marker_count(const std::string& family) {
  for (const MarkerFamily& f : families)
    if (family == f.name) return f.count;
  std::string known;
  for (const MarkerFamily& f : families) known += (known.empty() ? "" : " | ") + std::string(f.name);
  throw InvalidArgument("marker family '" + family + "' is unknown; expected " + known);
}

}  // namespace kr5
