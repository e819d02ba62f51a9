#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "arm_log/logged_arm.hpp"

namespace arm_log_test {

using namespace kr5;
using namespace kr5::test;
using Catch::Matchers::Contains;

TEST_CASE("a log that cannot be used is refused with field, row and joint") {
  arm_log::ArmLog log = logged(moved_arm());
  REQUIRE_NOTHROW(log.validate(3));
  SECTION("another number of joints") {
    CHECK_THROWS_WITH(log.validate(4), Contains("q: found 1500 x 3") && Contains("expected 1500 x 4"));
  }
  SECTION("unequal length") {
    log.effort.conservativeResize(1499, 3);
    CHECK_THROWS_WITH(log.validate(3), Contains("effort: found 1499 x 3"));
  }
  SECTION("no number") {
    log.effort(7, 1) = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_WITH(log.validate(3), Contains("effort: row 7, joint 2"));
  }
  SECTION("infinite time") {
    log.t[4] = std::numeric_limits<double>::infinity();
    CHECK_THROWS_WITH(log.validate(3), Contains("t: row 4"));
  }
  SECTION("time that stands still") {
    log.t[9] = log.t[8];
    CHECK_THROWS_WITH(log.validate(3), Contains("t: row 9 is not later"));
  }
  SECTION("too short") {
    const Eigen::Index rows = 29;
    log.t.conservativeResize(rows);
    CHECK_THROWS_WITH(log.validate(3), Contains("found 29 rows, expected at least 30"));
  }
  SECTION("nothing to compare") {
    log.effort.resize(0, 0);
    CHECK_THROWS_WITH(log.validate(3), Contains("neither efforts nor currents"));
  }
  SECTION("no motion") {
    log.q.resize(0, 0);
    CHECK_THROWS_WITH(log.validate(3), Contains("neither positions nor commands"));
  }
}

}  // namespace arm_log_test
