// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/uncertainty/confidence.hpp>

/// @file
/// What repeated trials tell: rates of success, which of them fall short or differ, and medians.

namespace kr5::uncertainty {

/// How many of the trials succeeded.
struct Count {
  int successes = 0;
  int trials = 0;

  /// @throws InvalidArgument unless 0 <= successes <= trials and trials > 0.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("successes", self.successes, "Number of successes.");
    visit("trials", self.trials, "Number of trials.");
  }
};

/// A share of successes with its exact intervals.
struct SuccessRate {
  double rate = 0.0;      ///< [-]
  Interval interval;      ///< Two-sided, 95 %.
  double min_rate = 0.0;  ///< One-sided lower bound, 95 % [-].

  static void each_field(auto& self, auto&& visit) {
    visit("rate", self.rate, "Successes over trials [-].");
    visit("interval", self.interval, "Exact (Clopper and Pearson) two-sided 95 % interval [-].");
    visit("min_rate", self.min_rate, "Exact one-sided lower bound at 95 % [-].");
  }
};
SuccessRate success_rate(const Count& count);

/// Whether a rate is below the wanted one.
struct RateTest {
  double p = 1.0;      ///< Corrected for all that are tested together.
  bool below = false;  ///< At the level of the test.

  static void each_field(auto& self, auto&& visit) {
    visit("p", self.p, "Probability of so few successes at the wanted rate, corrected after Holm [-].");
    visit("below", self.below, "Whether the rate is below the wanted one.");
  }
};
/// Which of the rates are below `rate`: exact one-sided binomial tests, so that with the probability `level` at most
/// any of them is called so wrongly (Holm 1979).
std::vector<RateTest> test_rates(std::span<const Count> counts, double rate, double level = 0.05);

/// Probability of counts at least as unlikely as these two when both have the same rate: Fisher's exact test.
double same_rate_probability(const Count& one, const Count& other);

/// The median of values, and how far chance moves it.
struct SampleMedian {
  double median = 0.0;
  std::optional<Interval> interval;  ///< At least 95 %, from order statistics; none of fewer than six values.
  double quantile_90 = 0.0;          ///< Nine of ten values lie below it, interpolated.

  static void each_field(auto& self, auto&& visit) {
    visit("median", self.median, "Median, in the unit of the values.");
    visit("interval", self.interval, "Interval of the median, at least 95 %; None of fewer than six values.");
    visit("quantile_90", self.quantile_90, "The 90 % quantile of the values.");
  }
};
/// @throws InvalidArgument without values, or for one that is not finite.
SampleMedian sample_median(std::vector<double> values);

}  // namespace kr5::uncertainty
