// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <thread>

#include <kr5/rsi/real_time.hpp>

#include "rsi/sockets.hpp"

namespace kr5::rsi {

/// A thread that polls, with what the kernel grants it. Whoever has it declares it last, so that it ends first.
class RealTimeThread {
 public:
  /// @param what Cannot be made when this fails, for the error. @throws IoError when there is no descriptor left.
  explicit RealTimeThread(const char* what);
  ~RealTimeThread();
  RealTimeThread(const RealTimeThread&) = delete;
  RealTimeThread& operator=(const RealTimeThread&) = delete;

  /// Begins; `run` returns once `ending` can be read, and does not throw.
  void begin(const RealTimeOptions& options, std::function<void()> run);
  /// Descriptor that can be read as soon as the thread is to end.
  int ending() const noexcept { return wake_.get(); }
  RealTimeStatus status() const noexcept { return status_; }

 private:
  Descriptor wake_;
  RealTimeStatus status_;
  std::thread thread_;
};

}  // namespace kr5::rsi
