// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include <kr5/rsi/telegram.hpp>

namespace kr5::rsi {

/// Cuts a stream into telegrams at the closing tag of their root.
class StreamFramer {
 public:
  /// @param closing "</Rob>".
  explicit StreamFramer(std::string_view closing) noexcept : closing_(closing) {}

  /// Where the next bytes go.
  std::span<char> room() noexcept { return {buffer_.data() + end_, buffer_.size() - end_}; }
  void added(std::size_t count) noexcept { end_ += count; }
  /// The next whole telegram, good until the next call; empty: there is none yet. One that is longer than any is
  /// handed on in part, to be counted.
  std::string_view next() noexcept;
  void clear() noexcept { begin_ = end_ = searched_ = 0; }

 private:
  std::string_view closing_;
  std::size_t begin_ = 0, end_ = 0;
  std::size_t searched_ = 0;  ///< Up to here there is no closing tag.
  std::array<char, 2 * max_telegram> buffer_{};
};

}  // namespace kr5::rsi
