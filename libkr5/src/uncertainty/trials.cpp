// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/uncertainty/trials.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/hypergeometric.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>

namespace kr5::uncertainty {
namespace {

/// Holm's correction: probabilities that may be compared with the level of all tests together.
std::vector<double> corrected_together(const std::vector<double>& p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return p[k]; });
  std::vector<double> out(p.size());
  double most = 0.0;
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    most = std::max(most, std::min(1.0, static_cast<double>(order.size() - rank) * p[order[rank]]));
    out[order[rank]] = most;
  }
  return out;
}

/// How many of n values, in their order, lie outside of the interval of the median at each end, with one more: the
/// least k with which fewer than k of them are below the median with a probability of 2.5 % or more.
std::size_t median_rank(std::size_t n) {
  const boost::math::binomial below(static_cast<double>(n), 0.5);
  std::size_t k = 0;
  while (boost::math::cdf(below, static_cast<double>(k)) < 0.025) ++k;
  return k;
}

}  // namespace

void Count::validate() const {
  require(trials > 0 && successes >= 0 && successes <= trials,
          "expected 0 <= successes <= trials and trials > 0, found " + std::to_string(successes) + " of " +
              std::to_string(trials));
}

SuccessRate success_rate(const Count& count) {
  count.validate();
  // Each end of a two-sided 90 % interval is a one-sided 95 % bound.
  return {static_cast<double>(count.successes) / count.trials, binomial_interval(count.successes, count.trials),
          binomial_interval(count.successes, count.trials, 0.9).low};
}

std::vector<RateTest> test_rates(std::span<const Count> counts, double rate, double level) {
  require(rate > 0 && rate < 1, "rate must lie between 0 and 1, found " + std::to_string(rate));
  require(level > 0 && level < 1, "level must lie between 0 and 1, found " + std::to_string(level));
  std::vector<double> p;
  for (const Count& count : counts) {
    count.validate();
    p.push_back(boost::math::cdf(boost::math::binomial(count.trials, rate), count.successes));
  }
  std::vector<RateTest> out;
  for (const double corrected : corrected_together(p)) out.push_back({corrected, corrected < level});
  return out;
}

double same_rate_probability(const Count& one, const Count& other) {
  one.validate();
  other.validate();
  const int successes = one.successes + other.successes, all = one.trials + other.trials;
  const boost::math::hypergeometric of_one(static_cast<unsigned>(successes), static_cast<unsigned>(one.trials),
                                           static_cast<unsigned>(all));
  const auto probability = [&](int k) { return boost::math::pdf(of_one, static_cast<unsigned>(k)); };
  constexpr double rounding = 1e-7;  // of probabilities that are equal
  const double found = probability(one.successes) * (1 + rounding);
  double sum = 0.0;
  for (int k = std::max(0, successes - other.trials); k <= std::min(successes, one.trials); ++k)
    if (const double p = probability(k); p <= found) sum += p;
  return std::min(sum, 1.0);
}

SampleMedian sample_median(std::vector<double> values) {
  require(!values.empty() && std::ranges::all_of(values, [](double x) { return std::isfinite(x); }),
          "values must be finite, and at least one");
  std::ranges::sort(values);
  const std::size_t n = values.size(), k = median_rank(n);
  SampleMedian out;
  out.median = midpoint_median(values);
  if (k > 0) out.interval = Interval{values[k - 1], values[n - k]};
  const double at = 0.9 * static_cast<double>(n - 1);
  const auto below = static_cast<std::size_t>(at);
  const double above = values[std::min(below + 1, n - 1)];
  out.quantile_90 = values[below] + (at - static_cast<double>(below)) * (above - values[below]);
  return out;
}

}  // namespace kr5::uncertainty
