#include "gap/wording/number_text.hpp"

#include <limits>

#include <catch2/catch.hpp>

/// @file
/// Numbers as people read them.

namespace number_text_test {

using namespace kr5;

TEST_CASE("a number has the digits that its uncertainty allows") {
  CHECK(gap::number_text(31.2468, 0.012) == "31.247");
  CHECK(gap::number_text(31.2468, 0.9) == "31.25");
  CHECK(gap::number_text(31.2468, 25.0) == "31");
  CHECK(gap::number_text(31.2468) == "31.25");  // four digits without
  CHECK(gap::number_text(-0.00012346) == "-0.0001235");
  CHECK(gap::number_text(std::numeric_limits<double>::infinity()) == "–");
  CHECK(gap::number_text(1.0, std::numeric_limits<double>::quiet_NaN()) == "1");
}

TEST_CASE("a share is never 0 or 100 %, and a gap has two digits, large ones one") {
  CHECK(gap::percent_text(0.42) == "42 %");
  CHECK(gap::percent_text(0.996) == "more than 99 %");
  CHECK(gap::percent_text(1.0) == "more than 99.9 %");
  CHECK(gap::percent_text(0.004) == "less than 1 %");
  CHECK(gap::percent_text(-0.2) == "less than 1 %");
  CHECK(gap::gap_text(9.994) == "9.99");
  CHECK(gap::gap_text(10.04) == "10.0");
}

TEST_CASE("units are those of people: millimetres, degrees, milliseconds") {
  CHECK(gap::text_unit("m", 0.1) == std::pair<double, std::string>(1e3, "mm"));
  CHECK(gap::text_unit("rad", 3.0).first == Approx(57.29577951));
  CHECK(gap::text_unit("s", 0.5).second == "ms");
  CHECK(gap::text_unit("s", 2.0) == std::pair<double, std::string>(1.0, "s"));  // long times stay
  CHECK(gap::text_unit("N.m.s/rad", 1.0).second == "N m s/rad");
  CHECK(gap::text_unit("kg.m^2", 1.0).second == "kg m²");
}

TEST_CASE("lists, first letters and numbers at the end of names") {
  CHECK(gap::join_list({}) == "");
  CHECK(gap::join_list({"a"}) == "a");
  CHECK(gap::join_list({"a", "b"}) == "a and b");
  CHECK(gap::join_list({"a", "b", "c"}, "or") == "a, b or c");
  CHECK(gap::capitalised("") == "");
  CHECK(gap::capitalised("the gap") == "The gap");
  CHECK(gap::split_number("joint12") == std::pair<std::string, int>("joint", 12));
  CHECK(gap::split_number("tool") == std::pair<std::string, int>("tool", 0));
  CHECK(gap::split_number("7") == std::pair<std::string, int>("", 7));
  CHECK(gap::split_number("id12345678901").second == 0);  // no number of a joint
}

}  // namespace number_text_test
