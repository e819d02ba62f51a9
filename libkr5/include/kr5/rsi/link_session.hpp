// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include <kr5/rsi/link_options.hpp>
#include <kr5/rsi/telegram_codec.hpp>

/// @file
/// The computer's end of the link without its socket and clock: bytes in, bytes out.

namespace kr5::rsi {

/// What computes a command from a reading, once a cycle: any function of a reading that throws nothing.
class CycleFunction {
 public:
  /// Commands nothing.
  CycleFunction() = default;
  template <class F>
  requires(std::is_nothrow_invocable_r_v<robot::RobotCommand, F&, const robot::RobotReading&> &&
           !std::is_same_v<std::remove_cvref_t<F>, CycleFunction>) CycleFunction(F function)
      : function_(std::move(function)) {}

  robot::RobotCommand operator()(const robot::RobotReading& reading) const noexcept {
    return function_ ? function_(reading) : robot::RobotCommand();
  }

 private:
  std::function<robot::RobotCommand(const robot::RobotReading&)> function_;
};

/// Answers telegrams. One thread calls `answer`; any may call the rest. Once made, it allocates nothing, throws nothing
/// and waits for nobody, if the function does not.
///
/// A session begins with the first good telegram, after a silence, or where IPOC jumps back by more than a second or
/// ahead by more than ten. The first answer moves nothing (PathCorrection::begin): it is that to the second telegram
/// where the first does not tell the correction that the controller makes. Within a session only its sender is
/// answered. Equal telegrams have equal answers: the time of a reading is that of IPOC. A stop ends the motion of the
/// program, too, where the layout has an element for that, also while the link holds.
class LinkSession {
 public:
  /// @throws InvalidArgument as layout, model and options.
  LinkSession(const TelegramLayout& layout, const robot::SensorModel& model, const LinkOptions& options,
              CycleFunction step);

  /// The answer to a datagram; empty: it gets none. Good until the next call.
  /// @param sender Any number that tells senders apart. @param arrival By a steady clock [ns].
  std::string_view answer(std::string_view bytes, std::uint64_t sender, std::int64_t arrival) noexcept;
  /// What the clock says of the last answer. @param lateness From the arrival to when it was read [ns].
  /// @param duration From the arrival to when the answer was sent [ns].
  void note_sent(bool sent, std::int64_t lateness, std::int64_t duration) noexcept;
  void note_stranger() noexcept { add(Strangers); }
  /// Time has passed without a telegram. @param now [ns].
  void note_silence(std::int64_t now) noexcept;

  /// The connection is over: the next telegram begins a session, whoever sends it.
  void end() noexcept;

  /// After Reconnect::Hold: commands count again.
  void resume() noexcept { resume_.store(true); }
  LinkStatistics statistics() const noexcept;

 private:
  enum Counter { Answered, Late, Lost, Repeated, Reordered, Strangers, Sessions, Limited, Refused, Unsent, Counters };

  void add(Counter counter, std::uint64_t count = 1) noexcept {
    counters_[counter].fetch_add(count, std::memory_order_relaxed);
  }
  void begin(const Telegram& telegram, const ControllerState& state, std::uint64_t sender) noexcept;
  bool is_in_order(const Telegram& telegram, std::int64_t since, bool& repeated) noexcept;
  std::string_view corrected(const Telegram& telegram, const ControllerState& state) noexcept;

  TelegramCodec reader_, writer_;
  TelegramUnits units_;
  PathCorrection correction_;
  std::optional<ControllerState> first_;  ///< Of a session whose correction the next telegram tells.
  robot::SensorModel model_;
  LinkOptions options_;
  CycleFunction step_;

  bool begun_ = false;    ///< There was a session.
  bool running_ = false;  ///< There is one.
  bool holding_ = false, stopped_ = false;
  std::uint64_t sender_ = 0;
  std::int64_t last_arrival_ = 0, silence_ = 0, deadline_ = 0;
  double time_ = 0.0;  ///< Of the last telegram by IPOC [s].
  Ipoc last_ipoc_;
  Telegram in_, out_;
  std::array<char, max_telegram> bytes_{};
  std::size_t size_ = 0;

  std::atomic<bool> resume_{false};
  std::atomic<LinkState> state_{LinkState::Waiting};
  std::atomic<double> late_packets_{0.0};
  std::array<std::atomic<std::uint64_t>, Counters> counters_{};
  std::array<std::atomic<std::uint64_t>, 16> telegrams_{};
  DurationHistogram period_, answer_, lateness_;
};

}  // namespace kr5::rsi
