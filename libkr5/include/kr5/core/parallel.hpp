// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace kr5 {

/// Calls `work(i)` for i in [0, count) on `threads` threads, 0: one a core. The first exception is passed on.
template <class Work>
void parallel_for(int count, int threads, const Work& work) {
  if (threads <= 0) threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::atomic<int> next{0};
  std::exception_ptr error;
  std::mutex guard;
  const auto run = [&] {
    for (int i = next++; i < count; i = next++) try {
        work(i);
      } catch (...) {
        const std::lock_guard lock(guard);
        if (!error) error = std::current_exception();
        next = count;
      }
  };
  std::vector<std::thread> pool;
  for (int k = 1; k < std::min(threads, count); ++k) pool.emplace_back(run);
  run();
  for (std::thread& thread : pool) thread.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace kr5
