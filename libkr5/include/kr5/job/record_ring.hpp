// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include <kr5/job/record.hpp>

namespace kr5::job {

/// Records on their way from the cycle of a controller to the disk: one thread pushes, one other takes. Allocates
/// nothing, throws nothing, waits for nobody.
class RecordRing {
 public:
  static constexpr std::size_t capacity = 256;

  /// Of the thread that controls: numbers the record and hands it over.
  /// @return Its number; 0 when there is no room, and nothing was handed over.
  std::uint64_t push(JobRecord record) noexcept;
  /// Number of the last record on the disk.
  std::uint64_t written() const noexcept { return written_.load(std::memory_order_acquire); }
  /// Whether the last attempt to write failed.
  bool failed() const noexcept { return failed_.load(std::memory_order_acquire); }

  /// Of the thread that writes: the record behind `number`, null when there is none yet.
  const JobRecord* after(std::uint64_t number) const noexcept;
  /// Everything up to `number` is on the disk, and its room is free again.
  void note_written(std::uint64_t number) noexcept;
  void note_failure() noexcept { failed_.store(true, std::memory_order_release); }
  /// Numbers go on behind those of an earlier program; before anything is pushed.
  void begin_after(std::uint64_t number) noexcept;

 private:
  std::array<JobRecord, capacity> records_;
  std::atomic<std::uint64_t> pushed_{0}, written_{0};
  std::atomic<bool> failed_{false};
};

}  // namespace kr5::job
