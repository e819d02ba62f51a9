// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/duration_histogram.hpp>

#include <algorithm>
#include <bit>
#include <cmath>

namespace kr5::rsi {
namespace {

constexpr auto loosely = std::memory_order_relaxed;
constexpr double nanosecond = 1e-9;  // [s]
constexpr double per_decade = 4.0;   // times of a tail

/// Number of the least duration that is long enough for a share of all not to be longer.
double rank_of(double share, double all) { return std::max(std::ceil(share * all), 1.0); }

}  // namespace

std::size_t DurationHistogram::bin_of(std::uint64_t nanoseconds) noexcept {
  const int shift = std::max(0, static_cast<int>(std::bit_width(nanoseconds)) - share_bits - 1);
  const std::size_t bin = (static_cast<std::size_t>(shift) << share_bits) + (nanoseconds >> shift);
  return std::min(bin, bins - 1);
}

/// The longest duration of a bin.
std::uint64_t DurationHistogram::end_of(std::size_t bin) noexcept {
  const std::size_t per_octave = std::size_t{1} << share_bits;
  const std::size_t shift = bin < 2 * per_octave ? 0 : (bin >> share_bits) - 1;
  return ((bin - (shift << share_bits) + 1) << shift) - 1;
}

void DurationHistogram::add(std::int64_t nanoseconds) noexcept {
  const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(nanoseconds, 0));
  counts_[bin_of(value)].fetch_add(1, loosely);
  sum_.fetch_add(value, loosely);
  if (value < least_.load(loosely)) least_.store(value, loosely);
  if (value > longest_.load(loosely)) longest_.store(value, loosely);
}

void DurationHistogram::clear() noexcept {
  for (auto& count : counts_) count.store(0, loosely);
  sum_.store(0, loosely);
  least_.store(~std::uint64_t{0}, loosely);
  longest_.store(0, loosely);
}

Distribution DurationHistogram::summary() const noexcept {
  Distribution out;
  for (const auto& count : counts_) out.count += count.load(loosely);
  if (out.count == 0) return out;
  const auto all = static_cast<double>(out.count);
  const std::uint64_t longest = longest_.load(loosely);
  out.mean = nanosecond * static_cast<double>(sum_.load(loosely)) / all;
  out.min = nanosecond * static_cast<double>(least_.load(loosely));
  out.max = nanosecond * static_cast<double>(longest);
  std::uint64_t below = 0;
  int tail = 0;  // times that are known
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const std::uint64_t here = counts_[bin].load(loosely);
    if (here == 0) continue;
    const double end = nanosecond * static_cast<double>(bin == bins - 1 ? longest : std::min(end_of(bin), longest));
    const auto first = static_cast<double>(below), last = static_cast<double>(below + here);
    for (const auto& [share, quantile] : {std::pair{0.5, &out.p50}, {0.99, &out.p99}, {0.999, &out.p999}})
      if (const double rank = rank_of(share, all); first < rank && last >= rank) *quantile = end;
    while (tail < tail_points && last >= rank_of(1.0 - std::pow(10.0, -tail / per_decade), all)) out.tail[tail++] = end;
    below += here;
  }
  return out;
}

std::uint64_t DurationHistogram::longer_than(std::int64_t nanoseconds) const noexcept {
  std::uint64_t out = 0;
  for (std::size_t bin = bin_of(static_cast<std::uint64_t>(std::max<std::int64_t>(nanoseconds, 0))) + 1; bin < bins;
       ++bin)
    out += counts_[bin].load(loosely);
  return out;
}

}  // namespace kr5::rsi
