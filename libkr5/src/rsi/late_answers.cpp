// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/late_answers.hpp>

#include <algorithm>

namespace kr5::rsi {
namespace {

constexpr double share_rounding = 1e-9;

}  // namespace

LateAnswers::LateAnswers(const ControllerRules& rules)
    : max_late_((rules.validate(), rules.max_late)),
      max_share_(rules.max_late_share.value_or(2.0)),
      late_(static_cast<std::size_t>(rules.late_window), false) {}

double LateAnswers::share() const noexcept {
  return static_cast<double>(in_window_) / static_cast<double>(late_.size());
}

ProgramStopReason LateAnswers::count(bool answered) noexcept {
  in_window_ += static_cast<int>(!answered) - static_cast<int>(late_[at_]);
  late_[at_] = !answered;
  at_ = (at_ + 1) % late_.size();
  if (answered) return in_succession_ = 0, ProgramStopReason::None;
  ++total_;
  most_ = std::max(most_, ++in_succession_);
  if (in_succession_ >= max_late_) return ProgramStopReason::LateAnswers;
  return share() >= max_share_ - share_rounding ? ProgramStopReason::LateShare : ProgramStopReason::None;
}

void LateAnswers::restart() noexcept {
  late_.assign(late_.size(), false);
  in_window_ = in_succession_ = 0;
}

}  // namespace kr5::rsi
