// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/exchange_ring.hpp"

#include <algorithm>
#include <cstring>

namespace kr5::rsi {

void ExchangeRing::write(const void* from, std::size_t size) noexcept {
  const std::size_t at = writing_ % bytes_.size(), first = std::min(size, bytes_.size() - at);
  std::memcpy(bytes_.data() + at, from, first);
  std::memcpy(bytes_.data(), static_cast<const char*>(from) + first, size - first);
  writing_ += size;
}

void ExchangeRing::read(void* to, std::size_t size) noexcept {
  const std::size_t at = reading_ % bytes_.size(), first = std::min(size, bytes_.size() - at);
  std::memcpy(to, bytes_.data() + at, first);
  std::memcpy(static_cast<char*>(to) + first, bytes_.data(), size - first);
  reading_ += size;
}

bool ExchangeRing::put(const ExchangeView& e, std::int64_t wall) noexcept {
  const Head head{e.sender, e.arrival, wall, e.duration, e.telegram.size(), e.answer.size()};
  const std::size_t size = sizeof head + head.telegram + head.answer;
  if (writing_ + size - read_.load(std::memory_order_acquire) > bytes_.size()) return false;
  write(&head, sizeof head);
  if (head.telegram > 0) write(e.telegram.data(), head.telegram);
  if (head.answer > 0) write(e.answer.data(), head.answer);
  written_.store(writing_, std::memory_order_release);
  return true;
}

bool ExchangeRing::take(Head& head, std::string& telegram, std::string& answer) {
  if (written_.load(std::memory_order_acquire) == reading_) return false;
  read(&head, sizeof head);
  telegram.resize(head.telegram);
  answer.resize(head.answer);
  if (head.telegram > 0) read(telegram.data(), head.telegram);
  if (head.answer > 0) read(answer.data(), head.answer);
  read_.store(reading_, std::memory_order_release);
  return true;
}

}  // namespace kr5::rsi
