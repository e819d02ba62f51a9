// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

/// @file
/// From one thread to one other, neither of which waits. Nothing here allocates or throws once it is made.

namespace kr5::work {

/// One value on its way.
template <class Value>
class HandoverSlot {
 public:
  /// False while the last value has not been taken.
  bool put(const Value& value) noexcept {
    if (full_.load(std::memory_order_acquire)) return false;
    value_ = value;
    full_.store(true, std::memory_order_release);
    return true;
  }
  /// The value, null when there is none; good until it is taken.
  const Value* look() const noexcept { return full_.load(std::memory_order_acquire) ? &value_ : nullptr; }
  void take() noexcept { full_.store(false, std::memory_order_release); }

 private:
  Value value_;
  std::atomic<bool> full_ = false;
};

/// Values on their way, in their order.
template <class Value>
class HandoverRing {
 public:
  explicit HandoverRing(std::size_t capacity) : values_(capacity) {}

  /// False when there is no room.
  bool put(const Value& value) noexcept {
    const std::uint64_t next = put_.load(std::memory_order_relaxed);
    if (next - taken_.load(std::memory_order_acquire) >= values_.size()) return false;
    values_[next % values_.size()] = value;
    put_.store(next + 1, std::memory_order_release);
    return true;
  }
  /// The oldest value, null when there is none; good until it is taken.
  const Value* look() const noexcept {
    const std::uint64_t next = taken_.load(std::memory_order_relaxed);
    return next < put_.load(std::memory_order_acquire) ? &values_[next % values_.size()] : nullptr;
  }
  void take() noexcept { taken_.fetch_add(1, std::memory_order_release); }

 private:
  std::vector<Value> values_;
  std::atomic<std::uint64_t> put_{0}, taken_{0};
};

}  // namespace kr5::work
