#include "rsi/number_text.hpp"

#include <catch2/catch.hpp>

using kr5::rsi::number_text;

namespace number_text_test {

TEST_CASE("numbers of files are rounded to four decimals, without zeros at their end") {
  CHECK(number_text(0.0) == "0");
  CHECK(number_text(-1e-9) == "0");
  CHECK(number_text(-90.00000000001) == "-90");
  CHECK(number_text(5.00192) == "5.0019");
  CHECK(number_text(100.0) == "100");
  CHECK(number_text(0.5) == "0.5");
}

}  // namespace number_text_test
