// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/parallel.hpp>

#include <atomic>
#include <stdexcept>
#include <vector>

#include <catch2/catch.hpp>

namespace parallel_test {

using kr5::parallel_for;

TEST_CASE("each index is worked on once, whatever the number of threads") {
  for (const int threads : {0, 1, 2, 7})
    for (const int count : {0, 1, 5, 1000}) {
      std::vector<std::atomic<int>> times(static_cast<std::size_t>(count));
      parallel_for(count, threads, [&](int i) { ++times[static_cast<std::size_t>(i)]; });
      for (const std::atomic<int>& n : times) REQUIRE(n == 1);
    }
}

TEST_CASE("an exception is passed on, and no index is begun after it was caught") {
  std::atomic<int> begun{0};
  const auto work = [&](int i) {
    ++begun;
    if (i == 3) throw std::runtime_error("three");
  };
  CHECK_THROWS_WITH(parallel_for(100, 1, work), "three");
  CHECK(begun == 4);
  CHECK_THROWS_WITH(parallel_for(100, 4, work), "three");  // which others had begun by then is a matter of chance
}

}  // namespace parallel_test
