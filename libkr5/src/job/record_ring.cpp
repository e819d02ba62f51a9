// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/job/record_ring.hpp>

namespace kr5::job {

std::uint64_t RecordRing::push(JobRecord record) noexcept {
  const std::uint64_t last = pushed_.load(std::memory_order_relaxed);
  if (last - written_.load(std::memory_order_acquire) >= capacity) return 0;
  record.number = last + 1;
  records_[record.number % capacity] = record;
  pushed_.store(record.number, std::memory_order_release);
  return record.number;
}

const JobRecord* RecordRing::after(std::uint64_t number) const noexcept {
  return number < pushed_.load(std::memory_order_acquire) ? &records_[(number + 1) % capacity] : nullptr;
}

void RecordRing::note_written(std::uint64_t number) noexcept {
  failed_.store(false, std::memory_order_relaxed);
  written_.store(number, std::memory_order_release);
}

void RecordRing::begin_after(std::uint64_t number) noexcept {
  pushed_.store(number, std::memory_order_relaxed);
  written_.store(number, std::memory_order_release);
}

}  // namespace kr5::job
