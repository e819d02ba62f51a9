#include <kr5/arm_log/time_unit.hpp>

#include <limits>
#include <utility>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

namespace time_unit_test {

using namespace kr5;
using arm_log::guess_time_unit;
using arm_log::seconds_in;
using arm_log::TimeUnit;
using Eigen::VectorXd;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

VectorXd even(double first, double step, Eigen::Index rows = 50) {
  return VectorXd::LinSpaced(rows, first, first + step * static_cast<double>(rows - 1));
}

TEST_CASE("the unit of a clock from 0 is told by its steps", "[time_unit]") {
  for (const auto& [step, unit] :
       {std::pair(0.2, TimeUnit::Second), std::pair(0.004, TimeUnit::Second), std::pair(4.0, TimeUnit::Millisecond),
        std::pair(1000.0, TimeUnit::Microsecond), std::pair(4e6, TimeUnit::Nanosecond)})
    CHECK(guess_time_unit(even(0, step)) == unit);
  CHECK(guess_time_unit(even(0, 12), 0.012) == TimeUnit::Millisecond);
  CHECK(guess_time_unit(even(0, 4.0), 4.0) == TimeUnit::Second);
  CHECK(guess_time_unit(even(0, 4.0), 0.0) == TimeUnit::Second);  // nothing is known of the steps
}

TEST_CASE("stamps since 1970 are of this century", "[time_unit]") {
  for (const TimeUnit unit : {TimeUnit::Second, TimeUnit::Millisecond, TimeUnit::Microsecond, TimeUnit::Nanosecond}) {
    const double per_second = 1 / seconds_in(unit);
    for (const double usual : {0.005, 0.0})
      CHECK(guess_time_unit(even(1.7e9 * per_second, 0.6 * per_second), usual) == unit);
  }
  CHECK(guess_time_unit(even(1.2e9, 4.0)) == TimeUnit::Millisecond);  // a counter: rows 4 s apart are no motion
}

TEST_CASE("rows that stand still, go back or hold no time do not count", "[time_unit]") {
  VectorXd stamps = even(0, 4.0);
  stamps[10] = nan, stamps[11] = std::numeric_limits<double>::infinity(), stamps[20] = stamps[19], stamps[30] = 0;
  CHECK(guess_time_unit(stamps) == TimeUnit::Millisecond);
  CHECK(guess_time_unit(VectorXd::Constant(9, nan), 0.0) == TimeUnit::Second);
  CHECK(guess_time_unit(VectorXd(), 0.0) == TimeUnit::Second);
  CHECK_NOTHROW(guess_time_unit(VectorXd::Constant(9, 5.0)));
}

TEST_CASE("a usual step is no negative number", "[time_unit]") {
  CHECK_THROWS_AS(guess_time_unit(even(0, 1), -1.0), InvalidArgument);
  CHECK_THROWS_AS(guess_time_unit(even(0, 1), nan), InvalidArgument);
}

TEST_CASE("stamps that count rows tell no time") {
  CHECK(arm_log::counts_rows(Eigen::VectorXd::LinSpaced(50, 0, 49)));
  CHECK(arm_log::counts_rows(Eigen::VectorXd::LinSpaced(50, 1, 50)));
  CHECK_FALSE(arm_log::counts_rows(Eigen::VectorXd::LinSpaced(50, 0, 98)));
  CHECK_FALSE(arm_log::counts_rows(Eigen::VectorXd::LinSpaced(50, 1000, 1049)));
  CHECK_FALSE(arm_log::counts_rows(Eigen::VectorXd::LinSpaced(5, 0, 4)));
}

}  // namespace time_unit_test
