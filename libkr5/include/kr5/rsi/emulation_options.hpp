// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/robot/command.hpp>
#include <kr5/rsi/emulation_events.hpp>

namespace kr5::rsi {

/// From when on the cycles without an answer count.
enum class CountFrom {
  Telegram,  ///< The first telegram, as on a controller.
  Answer,    ///< The first good answer: as if the program had been started once the computer was ready.
};
constexpr auto enum_names(CountFrom) {
  return names<CountFrom>({{CountFrom::Telegram, "telegram"}, {CountFrom::Answer, "answer"}});
}

/// A controller and its program.
struct EmulationOptions {
  ControllerRules rules = {};
  robot::CommandMode mode = robot::CommandMode::Absolute;
  robot::CommandFrame frame = robot::CommandFrame::Base;
  CountFrom count_from = CountFrom::Telegram;
  std::vector<Eigen::VectorXd> path = {};  ///< [rad or m]
  double path_speed = 0.2;                 ///< [rad/s]
  double override_share = 1.0;             ///< [-]
  Eigen::VectorXd axis_speeds;             ///< [rad/s or m/s]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("rules", self.rules, "Rules of the controller.");
    visit("mode", self.mode, "Corrections of the program: absolute | relative.");
    visit("frame", self.frame, "Axes of its Cartesian corrections: base | tool.");
    visit("count_from", self.count_from,
          "From when on cycles without an answer count: telegram (the first) | answer (the first good one).");
    visit("path", self.path, "Places that the program goes to one after the other; empty: it stands [rad or m].");
    visit("path_speed", self.path_speed, "Speed on this path of the joint with the longest way [rad/s].");
    visit("override_share", self.override_share, "Override of the program, 1: full speed [-].");
    visit("axis_speeds", self.axis_speeds,
          "Maximum speed of the setpoint of each joint, beyond which the program stops; empty: not judged [rad/s or "
          "m/s].");
  }
};

/// Since the controller began.
struct EmulationStatistics {
  ControllerPhase phase = ControllerPhase::Running;
  ProgramStop stop = {};
  std::uint64_t ipoc = 0;
  std::uint64_t programs = 0;
  std::uint64_t cycles = 0;
  std::uint64_t sent = 0;
  std::uint64_t answered = 0;
  std::uint64_t missing = 0;
  int missing_now = 0;
  int missing_most = 0;
  double missing_share = 0.0;
  std::uint64_t late = 0;
  std::uint64_t repeated = 0;
  std::uint64_t foreign = 0;
  std::uint64_t unasked = 0;
  TelegramCounts telegrams;
  std::uint64_t jumps = 0;
  double largest_jump = 0.0;
  std::uint64_t limited = 0;
  double override_share = 1.0;

  static void each_field(auto& self, auto&& visit) {
    visit("phase", self.phase, "What the controller does: running | drives_off | emergency_stop | ended.");
    visit("stop", self.stop, "Why the program ended.");
    visit("ipoc", self.ipoc, "IPOC of the last telegram.");
    visit("programs", self.programs, "How often the program was started.");
    visit("cycles", self.cycles, "Cycles.");
    visit("sent", self.sent, "Telegrams.");
    visit("answered", self.answered, "Cycles with a good answer.");
    visit("missing", self.missing, "Cycles without one.");
    visit("missing_now", self.missing_now, "Cycles without one in succession, at present.");
    visit("missing_most", self.missing_most, "The most of them in succession.");
    visit("missing_share", self.missing_share, "Their share of the latest cycles, of as many as the rules say [-].");
    visit("late", self.late, "Answers to an earlier telegram, or after the time for them.");
    visit("repeated", self.repeated, "Answers to a telegram that was answered already.");
    visit("foreign", self.foreign, "Answers whose IPOC was never sent.");
    visit("unasked", self.unasked, "Answers while there was no telegram to answer.");
    visit("telegrams", self.telegrams, "Answers by what was wrong with them.");
    visit("jumps", self.jumps, "How often a correction fell back because HOLDON is 0.");
    visit("largest_jump", self.largest_jump,
          "Largest of them, of an axis or, without corrections of axes, of X, Y or Z [rad or m].");
    visit("limited", self.limited, "Cycles in which a correction was held at its limit.");
    visit("override_share", self.override_share, "Override, 1: full speed [-].");
  }
};

}  // namespace kr5::rsi
