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

}  // namespace family_test
