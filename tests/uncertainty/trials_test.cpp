#include <kr5/uncertainty/trials.hpp>

#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

/// @file
/// Rates and medians of repeated trials.

namespace trials_test {

using namespace kr5;
using namespace kr5::uncertainty;

TEST_CASE("a rate has its exact interval and bound") {
  const SuccessRate all = success_rate({20, 20});
  CHECK(all.rate == 1.0);
  CHECK(all.interval.low == Approx(std::pow(0.025, 1.0 / 20)));
  CHECK(all.interval.high == 1.0);
  CHECK(all.min_rate == Approx(std::pow(0.05, 1.0 / 20)));
  CHECK(success_rate({0, 10}).min_rate == 0.0);
  CHECK_THROWS_WITH(success_rate({3, 2}), Catch::Matchers::Contains("found 3 of 2"));
  CHECK_THROWS_AS(success_rate({0, 0}), InvalidArgument);
}

TEST_CASE("rates that fall short are found by an exact test, corrected for how many are tested") {
  const std::vector<Count> counts = {{0, 3}, {2, 3}, {3, 3}};  // at one half: 1/8, 7/8, 1
  const std::vector<RateTest> found = test_rates(counts, 0.5, 0.4);
  CHECK(found[0].p == Approx(3.0 / 8));
  CHECK(found[1].p == Approx(1));  // twice 7/8
  CHECK(found[2].p == Approx(1));
  CHECK((found[0].below && !found[1].below && !found[2].below));
  CHECK_FALSE(test_rates(counts, 0.5)[0].below);
  CHECK(test_rates({}, 0.5).empty());
  CHECK_THROWS_AS(test_rates(counts, 1.0), InvalidArgument);
}

TEST_CASE("a corrected probability is at least that of the test before it") {
  // Of 1, 2 and 3 trials none succeeds with 0.1, 0.01 and 0.001.
  const std::vector<RateTest> found = test_rates(std::vector<Count>{{0, 1}, {0, 2}, {0, 3}}, 0.9, 0.05);
  CHECK(found[2].p == Approx(0.003));
  CHECK(found[1].p == Approx(0.02));
  CHECK(found[0].p == Approx(0.1));
  const std::vector<RateTest> equal = test_rates(std::vector<Count>{{0, 2}, {0, 2}}, 0.9, 0.05);
  CHECK(equal[0].p == Approx(0.02));
  CHECK(equal[1].p == Approx(0.02));  // not 0.01, which is less than that of the first
}

TEST_CASE("a difference of two rates is judged as by Fisher") {
  CHECK(same_rate_probability({3, 4}, {1, 4}) == Approx(34.0 / 70));  // the lady who tastes tea
  CHECK(same_rate_probability({5, 5}, {0, 5}) == Approx(2.0 / 252));
  CHECK(same_rate_probability({2, 7}, {2, 7}) == Approx(1));
  CHECK(same_rate_probability({0, 9}, {0, 4}) == Approx(1));
  CHECK(same_rate_probability({1, 1}, {0, 2}) == Approx(1.0 / 3));
  CHECK(same_rate_probability({0, 2}, {1, 1}) == Approx(1.0 / 3));
  CHECK_THROWS_AS(same_rate_probability({1, 1}, {0, 0}), InvalidArgument);
}

TEST_CASE("a median has an interval between values, of six at least") {
  std::vector<double> values;
  for (int k = 20; k >= 1; --k) values.push_back(k);
  const SampleMedian found = sample_median(values);
  CHECK(found.median == 10.5);
  REQUIRE(found.interval);
  CHECK(found.interval->low == 6.0);  // as tables have it: the 6th from either end
  CHECK(found.interval->high == 15.0);
  CHECK(found.quantile_90 == Approx(18.1));
  CHECK_FALSE(sample_median({5, 4, 3, 2, 1}).interval);
  CHECK(sample_median({6, 5, 4, 3, 2, 1}).interval->high == 6.0);
  CHECK(sample_median({7}).quantile_90 == 7.0);
  CHECK_THROWS_AS(sample_median({}), InvalidArgument);
  CHECK_THROWS_AS(sample_median({1, std::numeric_limits<double>::quiet_NaN()}), InvalidArgument);
}

TEST_CASE("the interval of a median holds the truth as often as its order statistics say") {
  Random random(3);
  constexpr int trials = 4000;
  int inside = 0;
  for (int trial = 0; trial < trials; ++trial) {
    std::vector<double> values;
    for (int k = 0; k < 15; ++k) values.push_back(std::exp(random.normal()));
    inside += sample_median(values).interval->contains(1.0);
  }
  // Between the 4th and the 12th of 15: all but 2 (1 + 15 + 105 + 455) / 2^15.
  CHECK(binomial_interval(inside, trials, 0.999).contains(1 - 2 * 576.0 / 32768));
}

}  // namespace trials_test
