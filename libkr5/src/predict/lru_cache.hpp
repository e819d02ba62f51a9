// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>
#include <list>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <Eigen/Core>

/// @file
/// Remembers what costs most of a prediction for the next one: who compares many effects asks for the same motion under
/// the same loads again and again.

namespace kr5::predict {

/// All numbers that a result depends on.
class CacheKey {
 public:
  CacheKey& add(double number) {
    numbers_.push_back(number);
    return *this;
  }
  template <class Derived>
  CacheKey& add(const Eigen::DenseBase<Derived>& numbers) {
    const std::size_t first = numbers_.size();
    numbers_.resize(first + static_cast<std::size_t>(numbers.size()));
    Eigen::Map<typename Derived::PlainMatrix>(numbers_.data() + first, numbers.rows(), numbers.cols()) = numbers;
    return *this;
  }

  std::size_t size() const { return numbers_.size(); }
  /// Gives back what was set aside for more numbers.
  void shrink() { numbers_.shrink_to_fit(); }
  /// To the bit, so that what is remembered is what would be computed.
  friend bool operator==(const CacheKey& a, const CacheKey& b) {
    return a.size() == b.size() && std::memcmp(a.numbers_.data(), b.numbers_.data(), a.size() * sizeof(double)) == 0;
  }
  std::uint64_t hash() const {
    std::uint64_t out = 0xcbf29ce484222325u;
    for (const double number : numbers_) {
      std::uint64_t bits = 0;
      std::memcpy(&bits, &number, sizeof bits);
      out = (out ^ bits ^ (bits >> 29)) * 0x9e3779b97f4a7c15u;
    }
    return out;
  }

 private:
  std::vector<double> numbers_;
};

/// The results asked for last, as many as fit into `limit` numbers of keys and values. For any number of threads.
template <class Value>
class LruCache {
 public:
  /// @param count Tells how many numbers a value holds.
  LruCache(std::size_t limit, std::size_t (*count)(const Value&)) : limit_(limit), count_(count) {}

  /// The value of a key; made by `make()` when it is not known.
  template <class Make>
  std::shared_ptr<const Value> find_or_make(CacheKey key, const Make& make) {
    const std::uint64_t hash = key.hash();
    if (auto known = find(hash, key)) return known;
    const auto value = std::make_shared<const Value>(make());
    const std::size_t size = key.size() + count_(*value);
    if (size > limit_) return value;
    key.shrink();
    const std::lock_guard lock(guard_);
    if (auto known = find_locked(hash, key)) return known;  // another thread was faster
    size_ += size;
    entries_.push_front({hash, size, std::move(key), value});
    while (size_ > limit_ || entries_.size() > most_entries) {
      size_ -= entries_.back().size;
      entries_.pop_back();
    }
    return value;
  }

 private:
  /// Short pieces of motions are cheap to compute, and would make a long list to look through.
  static constexpr std::size_t most_entries = 256;

  struct Entry {
    std::uint64_t hash;
    std::size_t size;
    CacheKey key;
    std::shared_ptr<const Value> value;
  };

  std::shared_ptr<const Value> find(std::uint64_t hash, const CacheKey& key) {
    const std::lock_guard lock(guard_);
    return find_locked(hash, key);
  }

  std::shared_ptr<const Value> find_locked(std::uint64_t hash, const CacheKey& key) {
    for (auto entry = entries_.begin(); entry != entries_.end(); ++entry)
      if (entry->hash == hash && entry->key == key) {
        entries_.splice(entries_.begin(), entries_, entry);
        return entry->value;
      }
    return nullptr;
  }

  std::mutex guard_;
  std::list<Entry> entries_;
  std::size_t limit_ = 0, size_ = 0;
  std::size_t (*count_)(const Value&);
};

}  // namespace kr5::predict
