// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <kr5/rsi/emulation_events.hpp>

namespace kr5::rsi {

/// Counts the cycles without a good answer against the limits of a controller. Once made, it allocates nothing and
/// throws nothing.
class LateAnswers {
 public:
  /// @throws InvalidArgument as ControllerRules::validate.
  explicit LateAnswers(const ControllerRules& rules);

  /// A cycle is over; why the program stops with it, if it does.
  ProgramStopReason count(bool answered) noexcept;
  /// A new program; what was counted in all stays.
  void restart() noexcept;

  int in_succession() const noexcept { return in_succession_; }
  int max_in_succession() const noexcept { return most_; }
  /// Of the latest cycles.
  double share() const noexcept;
  std::uint64_t total() const noexcept { return total_; }

 private:
  int max_late_;
  double max_share_;        ///< Above 1: not judged.
  std::vector<bool> late_;  ///< Of the cycles of the window, in a ring.
  std::size_t at_ = 0;
  int in_window_ = 0, in_succession_ = 0, most_ = 0;
  std::uint64_t total_ = 0;
};

}  // namespace kr5::rsi
