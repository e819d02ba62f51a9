// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/stream_framer.hpp"

#include <algorithm>

namespace kr5::rsi {

std::string_view StreamFramer::next() noexcept {
  const std::string_view all(buffer_.data(), end_);
  const std::size_t at = all.find(closing_, std::max(begin_, searched_));
  if (at != all.npos) {
    const std::string_view out = all.substr(begin_, at + closing_.size() - begin_);
    begin_ = searched_ = at + closing_.size();
    return out;
  }
  if (begin_ > 0) {  // what is left goes to the front
    std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
              buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
    end_ -= begin_;
    begin_ = 0;
  }
  searched_ = end_ >= closing_.size() ? end_ - closing_.size() + 1 : 0;
  if (end_ <= max_telegram) return {};
  const std::string_view out(buffer_.data(), end_);
  clear();
  return out;
}

}  // namespace kr5::rsi
