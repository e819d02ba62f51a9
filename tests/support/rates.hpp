#pragma once

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/uncertainty/confidence.hpp>

/// @file
/// Rates of success, judged by what a count proves: few trials do not pass for want of evidence against them. Under
/// sanitizers, which run an eighth of the trials and watch what the code does, a count fails only if the rate that is
/// promised would give it less than once in a thousand runs, whatever random numbers the compiler's order draws.

namespace kr5::test {

constexpr int few = 10;
constexpr double sanitized_confidence = 0.998;  ///< Two-sided, of which one side judges.

/// The rate that a count proves: the lower end of its exact 95 % interval.
inline double proven_rate(int successes, int trials) {
  return uncertainty::binomial_interval(successes, trials, 0.95).low;
}

/// The rate that a count rules out: the upper end of its exact 95 % interval.
inline double ruled_out_rate(int events, int trials) {
  return uncertainty::binomial_interval(events, trials, 0.95).high;
}

/// Checks that at least the promised share of the trials succeeded, which is every one of fewer than 1 / (1 -
/// promised), and that the count proves the rate `proven`, or had no miss where that is the most that so many trials
/// can prove.
inline void check_rate(int successes, int trials, double promised, double proven) {
  INFO(successes << " of " << trials << " succeeded, which proves a rate of " << proven_rate(successes, trials));
  REQUIRE(trials > 0);
#ifdef KR5_SANITIZED
  CHECK(uncertainty::binomial_interval(successes, trials, sanitized_confidence).high >= promised);
  static_cast<void>(proven);
#else
  CHECK(successes >= std::ceil(promised * trials - 1e-9));
  CHECK(proven_rate(successes, trials) >= std::min(proven, proven_rate(trials, trials)));
#endif
}

/// Checks that something happened in no more than the allowed share of the trials, or once, and that the count rules
/// out the rate `limit`, as far as that many trials can with one event among them. Of fewer than `few` trials none may
/// show it.
inline void check_rare(int events, int trials, double allowed, double limit) {
  INFO(events << " events in " << trials << " trials, which rules out a rate of " << ruled_out_rate(events, trials));
  REQUIRE(trials > 0);
#ifdef KR5_SANITIZED
  CHECK(uncertainty::binomial_interval(events, trials, sanitized_confidence).low <= allowed);
  static_cast<void>(limit);
#else
  const int bearable = trials < few ? 0 : 1;
  CHECK(events <= std::max<double>(bearable, std::floor(allowed * trials + 1e-9)));
  CHECK(ruled_out_rate(events, trials) <= std::max(limit, ruled_out_rate(bearable, trials)));
#endif
}

}  // namespace kr5::test
