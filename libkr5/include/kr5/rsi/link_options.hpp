// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include <kr5/rsi/correction_limits.hpp>
#include <kr5/rsi/cycles.hpp>
#include <kr5/rsi/duration_histogram.hpp>
#include <kr5/rsi/real_time.hpp>

namespace kr5::rsi {

/// What follows when the controller is there again after it was silent or has restarted.
enum class Reconnect {
  Hold,    ///< Answers without correction until `resume` is called.
  Resume,  ///< Commands count again at once.
};
constexpr auto enum_names(Reconnect) {
  return names<Reconnect>({{Reconnect::Hold, "hold"}, {Reconnect::Resume, "resume"}});
}

struct LinkOptions {
  robot::CommandMode mode = robot::CommandMode::Absolute;
  robot::CommandFrame frame = robot::CommandFrame::Base;
  double cycle = short_cycle;           ///< [s]
  std::optional<double> deadline = {};  ///< [s]
  double silence = 0.5;                 ///< [s]
  Reconnect reconnect = Reconnect::Hold;
  CorrectionLimits limits = {};
  bool answer = true;
  RealTimeOptions real_time = {};
  std::string listen = "0.0.0.0";

  /// @throws InvalidArgument naming the field.
  void validate() const;
  double deadline_or_usual() const noexcept;

  static void each_field(auto& self, auto&& visit) {
    visit("mode", self.mode, "Corrections, as in the controller's program: absolute | relative.");
    visit("frame", self.frame, "Axes of Cartesian corrections, as in the controller's program: base | tool.");
    visit("cycle", self.cycle, "Cycle of the controller [s].");
    visit("deadline", self.deadline,
          "Time after which an answer counts as late; none: ten twelfths of the cycle, as KUKA says of a KR C2 [s].");
    visit("silence", self.silence, "Time without a telegram after which a session is over [s].");
    visit("reconnect", self.reconnect,
          "What follows when the controller is there again: hold (no correction until told to resume) | resume.");
    visit("limits", self.limits, "Limits of the corrections.");
    visit("answer", self.answer, "Answer the controller; false: only listen, upon which it stops.");
    visit("real_time", self.real_time, "What the thread asks of the kernel.");
    visit("listen", self.listen, "Address of the network card to listen on; 0.0.0.0: every one.");
  }
};

enum class LinkState {
  Waiting,  ///< For a controller.
  Running,
  Holding,  ///< The controller is there again; answers correct nothing.
};
constexpr auto enum_names(LinkState) {
  using enum LinkState;
  return names<LinkState>({{Waiting, "waiting"}, {Running, "running"}, {Holding, "holding"}});
}

/// Since the link began.
struct LinkStatistics {
  LinkState state = LinkState::Waiting;
  Distribution period;    ///< From telegram to telegram.
  Distribution answer;    ///< From the arrival of a telegram to its answer.
  Distribution lateness;  ///< From the arrival to when the thread has it.
  TelegramCounts telegrams;
  std::uint64_t answered = 0;
  std::uint64_t late = 0;
  std::uint64_t lost = 0;
  std::uint64_t repeated = 0;
  std::uint64_t reordered = 0;
  std::uint64_t strangers = 0;
  std::uint64_t sessions = 0;
  std::uint64_t limited = 0;
  std::uint64_t refused = 0;
  std::uint64_t unsent = 0;
  double late_packets = 0.0;

  static void each_field(auto& self, auto&& visit) {
    visit("state", self.state, "State: waiting | running | holding.");
    visit("period", self.period, "Time from telegram to telegram.");
    visit("answer", self.answer, "Time from the arrival of a telegram to its answer.");
    visit("lateness", self.lateness, "Time from the arrival of a telegram to when the thread has it.");
    visit("telegrams", self.telegrams, "Telegrams by what was wrong with them.");
    visit("answered", self.answered, "Answers that were sent.");
    visit("late", self.late, "Answers that were sent after the deadline.");
    visit("lost", self.lost, "Telegrams that never came, by the gaps of IPOC.");
    visit("repeated", self.repeated, "Telegrams that came twice; they get the same answer.");
    visit("reordered", self.reordered, "Telegrams that a later one overtook; they get no answer.");
    visit("strangers", self.strangers, "Telegrams or connections of a second sender; they get no answer.");
    visit("sessions", self.sessions, "How often a controller began.");
    visit("limited", self.limited, "Commands that were followed as far as the limits allow.");
    visit("refused", self.refused, "Commands that could not be followed; the correction came to rest.");
    visit("unsent", self.unsent, "Answers that the network did not take.");
    visit("late_packets", self.late_packets, "Answers that the controller itself counts as late, last told [-].");
  }
};

}  // namespace kr5::rsi
