// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include <kr5/rsi/link.hpp>

namespace kr5::rsi {

/// Exchanges on their way from the thread of a link to another one. One thread puts, another takes; neither waits for
/// the other, and to put allocates nothing.
class ExchangeRing {
 public:
  struct Head {
    std::uint64_t sender = 0;
    std::int64_t arrival = 0, wall = 0, duration = 0;  ///< [ns]
    std::size_t telegram = 0, answer = 0;              ///< [bytes]
  };

  explicit ExchangeRing(std::size_t bytes) : bytes_(bytes) {}

  /// False where there is no room. @param wall Of the arrival, by the clock of the computer [ns].
  bool put(const ExchangeView& exchange, std::int64_t wall) noexcept;
  /// False where there is none.
  bool take(Head& head, std::string& telegram, std::string& answer);

 private:
  void write(const void* from, std::size_t size) noexcept;
  void read(void* to, std::size_t size) noexcept;

  std::vector<char> bytes_;
  std::size_t writing_ = 0, reading_ = 0;  ///< Of one thread each; positions that only rise.
  std::atomic<std::size_t> written_{0}, read_{0};
};

}  // namespace kr5::rsi
