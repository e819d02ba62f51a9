#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/geometry/marker_family.hpp>
#include <kr5/vision/family.hpp>

namespace family_test {

using namespace kr5;
using namespace kr5::vision;

TEST_CASE("every family has markers with a closed black border") {
  for (const std::string& family : marker_families()) {
    CAPTURE(family);
    const MarkerPattern p = marker_pattern(family, marker_count(family) - 1);
    const int first = (p.cells - p.square) / 2, last = first + p.square - 1;
    // 41h12 has its border outside in: the ring just outside the square is black, the rim inside white.
    const bool inside_out = family == "41h12";
    for (int i = first; i <= last; ++i) {
      CHECK(p.at(first, i) == inside_out);
      CHECK(p.at(i, last) == inside_out);
    }
    CHECK_THROWS_AS(marker_pattern(family, marker_count(family)), InvalidArgument);
  }
  CHECK_THROWS_WITH(marker_count("36h12"), Catch::Contains("36h11"));
}

TEST_CASE("a family is known by the names that others give it") {
  for (const auto& [name, own] : {std::pair{"tag36h11", "36h11"},
                                  {"36h11", "36h11"},
                                  {"tag25h9", "25h9"},
                                  {"tag16h5", "16h5"},
                                  {"tagStandard41h12", "41h12"},
                                  {"apriltag_36h11", "36h11"},
                                  {"DICT_APRILTAG_16h5", "16h5"},
                                  {"DICT_4X4_50", "aruco_4x4_50"},
                                  {"cv2.aruco.DICT_6X6_250", "aruco_6x6_250"},
                                  {"DICT_ARUCO_ORIGINAL", "aruco_original"}})
    CHECK(marker_family(name) == own);
  for (const char* name : {"", "tag", "tag36h10", "aruco", "4x4", "tagCircle21h7"})
    CHECK_THROWS_WITH(marker_family(name), Catch::Contains("is unknown; expected 36h11"));
  for (const std::string& family : marker_families()) CHECK(marker_family(family) == family);
}

}  // namespace family_test
