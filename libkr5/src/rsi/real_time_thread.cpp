// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/real_time_thread.hpp"

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <future>
#include <string>
#include <utility>

#include <sys/eventfd.h>
#include <unistd.h>

#include <kr5/core/error.hpp>

namespace kr5::rsi {

RealTimeThread::RealTimeThread(const char* what) : wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (!wake_) throw IoError(std::string(what) + " cannot be made: " + std::strerror(errno));
}

RealTimeThread::~RealTimeThread() {
  if (!thread_.joinable()) return;
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(wake_.get(), &one, sizeof one);
  thread_.join();
}

void RealTimeThread::begin(const RealTimeOptions& options, std::function<void()> run) {
  std::promise<RealTimeStatus> begun;
  std::future<RealTimeStatus> status = begun.get_future();
  thread_ = std::thread([options, run = std::move(run), begun = std::move(begun)]() mutable {
    begun.set_value(request_real_time(options));
    run();
  });
  status_ = status.get();
}

}  // namespace kr5::rsi
