// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>

namespace kr5::rsi {

/// Number of times in the tail of a distribution: down to one duration in a million.
inline constexpr int tail_points = 25;
using DurationTail = Eigen::Matrix<double, tail_points, 1>;

/// A summary of durations. Quantiles are those of a histogram, at most 1.6 % too long; mean and extremes are exact.
struct Distribution {
  std::uint64_t count = 0;
  double mean = 0.0;                         ///< [s]
  double min = 0.0;                          ///< [s]
  double p50 = 0.0;                          ///< [s]
  double p99 = 0.0;                          ///< [s]
  double p999 = 0.0;                         ///< [s]
  double max = 0.0;                          ///< [s]
  DurationTail tail = DurationTail::Zero();  ///< [s]

  static void each_field(auto& self, auto&& visit) {
    visit("count", self.count, "Number of durations.");
    visit("mean", self.mean, "Mean [s].");
    visit("min", self.min, "Least [s].");
    visit("p50", self.p50, "Median [s].");
    visit("p99", self.p99, "99 % are not longer [s].");
    visit("p999", self.p999, "99.9 % are not longer [s].");
    visit("max", self.max, "Longest [s].");
    visit("tail", self.tail,
          "Times that at most a share of 1, 10^-0.25, 10^-0.5 .. 10^-6 of the durations exceed [s].");
  }
};

/// Counts durations from 1 ns to 18 minutes, longer ones as such, in bins of a 64th of their length. One thread adds;
/// any thread may read meanwhile. Allocates and throws nothing, waits for nobody.
class DurationHistogram {
 public:
  /// @param nanoseconds Negative ones count as 0.
  void add(std::int64_t nanoseconds) noexcept;
  void clear() noexcept;
  Distribution summary() const noexcept;
  /// Durations that are longer, but for those in the bin that holds the limit.
  std::uint64_t longer_than(std::int64_t nanoseconds) const noexcept;

 private:
  static constexpr int share_bits = 6;  // bins of a 64th
  static constexpr std::size_t bins = (40 - share_bits + 1) << share_bits;

  static std::size_t bin_of(std::uint64_t nanoseconds) noexcept;
  static std::uint64_t end_of(std::size_t bin) noexcept;

  std::array<std::atomic<std::uint64_t>, bins> counts_{};
  std::atomic<std::uint64_t> sum_{0}, least_{~std::uint64_t{0}}, longest_{0};
};

}  // namespace kr5::rsi
