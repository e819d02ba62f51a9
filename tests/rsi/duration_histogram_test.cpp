#include <kr5/rsi/duration_histogram.hpp>

#include <algorithm>
#include <cmath>
#include <thread>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/random.hpp>

using namespace kr5;
using namespace kr5::rsi;

namespace duration_histogram_test {

TEST_CASE("quantiles are at most a 64th longer than the exact ones, extremes and mean are exact") {
  Random random(7);
  for (const double decades : {0.5, 3.0, 9.0}) {
    DurationHistogram histogram;
    std::vector<std::int64_t> all;
    for (int i = 0; i < 20000; ++i)
      all.push_back(static_cast<std::int64_t>(std::pow(10, random.uniform(0.3, decades))));
    double sum = 0;
    for (const std::int64_t v : all) histogram.add(v), sum += static_cast<double>(v);
    std::sort(all.begin(), all.end());
    const Distribution d = histogram.summary();
    CHECK(d.count == all.size());
    CHECK(d.min == Approx(1e-9 * static_cast<double>(all.front())));
    CHECK(d.max == Approx(1e-9 * static_cast<double>(all.back())));
    CHECK(d.mean == Approx(1e-9 * sum / 20000));
    for (const auto& [share, found] : {std::pair{0.5, d.p50}, {0.99, d.p99}, {0.999, d.p999}}) {
      const double exact = 1e-9 * static_cast<double>(all[static_cast<std::size_t>(std::ceil(share * 20000)) - 1]);
      CHECK(found >= exact * (1 - 1e-12));
      CHECK(found <= exact * (1 + 1.0 / 64) + 1e-12);
    }
    const auto longer = [&](double seconds) {
      return std::count_if(all.begin(), all.end(), [&](auto v) { return 1e-9 * static_cast<double>(v) > seconds; });
    };
    for (int k = 0; k < tail_points; ++k) {
      const double share = std::pow(10.0, -k / 4.0) * 20000;
      CHECK(static_cast<double>(longer(d.tail[k] * (1 + 1e-12))) <= share);
      CHECK(static_cast<double>(longer(d.tail[k] / (1 + 1.0 / 64) - 2e-9)) >= std::floor(share));
    }
    CHECK(d.tail[tail_points - 1] == d.max);
  }
}

TEST_CASE("nothing, one duration, and what is beyond all bins") {
  DurationHistogram histogram;
  CHECK((histogram.summary().count == 0 && histogram.summary().p999 == 0 && histogram.summary().min == 0));
  histogram.add(123456);
  Distribution d = histogram.summary();
  for (const double value : {d.min, d.p50, d.p99, d.p999, d.max, d.mean}) CHECK(value == Approx(123456e-9));
  CHECK((d.tail.array() == d.max).all());
  histogram.add(-5);
  histogram.add(std::int64_t{1} << 62);
  d = histogram.summary();
  CHECK((d.count == 3 && d.min == 0 && d.max == Approx(1e-9 * std::pow(2, 62))));
  CHECK(d.p999 == d.max);
  CHECK(histogram.longer_than(1'000'000) == 1);
  CHECK(histogram.longer_than(0) == 2);
  histogram.clear();
  CHECK(histogram.summary().count == 0);
}

TEST_CASE("it is read while another thread adds") {
  DurationHistogram histogram;
  std::thread writer([&] {
    for (int i = 0; i < 200000; ++i) histogram.add(1000 + i % 1000);
  });
  for (int i = 0; i < 50; ++i) {
    const Distribution d = histogram.summary();
    if (d.count == 0) continue;
    CHECK((d.p50 <= d.p99 && d.p99 <= d.p999 && d.max < 3e-6));
  }
  writer.join();
  CHECK(histogram.summary().count == 200000);
}

}  // namespace duration_histogram_test
