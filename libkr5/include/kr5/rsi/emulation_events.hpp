// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include <kr5/rsi/controller_rules.hpp>
#include <kr5/rsi/telegram.hpp>

/// @file
/// What happens to a controller, for those who watch it.

namespace kr5::rsi {

enum class ControllerPhase {
  Running,        ///< The program runs, corrected by the answers.
  DrivesOff,      ///< The arm stands.
  EmergencyStop,  ///< The arm brakes, and stands.
  Ended,          ///< The sensor interface is off until the program is reset; there are no telegrams.
};
constexpr auto enum_names(ControllerPhase) {
  using enum ControllerPhase;
  return names<ControllerPhase>(
      {{Running, "running"}, {DrivesOff, "drives_off"}, {EmergencyStop, "emergency_stop"}, {Ended, "ended"}});
}

/// Why a program ended.
enum class ProgramStopReason {
  None,
  LateAnswers,       ///< As many cycles in succession without a good answer as are allowed.
  LateShare,         ///< As large a share of them.
  AxisLimit,         ///< The total correction of an axis.
  TranslationLimit,  ///< The total correction along X, Y or Z.
  RotationLimit,     ///< The total correction of the orientation.
  CycleLimit,        ///< A change of the correction in one cycle.
  AxisSpeed,         ///< A setpoint that an axis cannot follow.
  Unreachable,       ///< A pose that the arm does not reach.
  Idle,              ///< Relative corrections of zero for too long.
  Asked,             ///< The computer ended RSI_MOVECORR.
  Disconnected,      ///< The computer closed the connection.
};
constexpr auto enum_names(ProgramStopReason) {
  using enum ProgramStopReason;
  return names<ProgramStopReason>({{None, "none"},
                                   {LateAnswers, "late_answers"},
                                   {LateShare, "late_share"},
                                   {AxisLimit, "axis_limit"},
                                   {TranslationLimit, "translation_limit"},
                                   {RotationLimit, "rotation_limit"},
                                   {CycleLimit, "cycle_limit"},
                                   {AxisSpeed, "axis_speed"},
                                   {Unreachable, "unreachable"},
                                   {Idle, "idle"},
                                   {Asked, "asked"},
                                   {Disconnected, "disconnected"}});
}

/// A reason, and the axis that it is about: 1 to 12, 0 for none.
struct ProgramStop {
  ProgramStopReason reason = ProgramStopReason::None;
  int axis = 0;

  explicit operator bool() const noexcept { return reason != ProgramStopReason::None; }

  static void each_field(auto& self, auto&& visit) {
    visit("reason", self.reason, "Why the program ended; none: it has not.");
    visit("axis", self.axis, "Number of the axis that this is about, external ones from 7; 0: none.");
  }
};

/// What the controller shows when the program ends; nothing for ProgramStopReason::None.
std::string stop_message(Controller controller, const ProgramStop& stop);

enum class EventKind {
  Started,   ///< The program, with the first telegram.
  Answered,  ///< The first good answer of a program.
  Missing,   ///< The first cycle without a good answer after one with.
  Jump,      ///< A correction that is not held fell back.
  Limited,   ///< A correction was held at its limit, which it was not before.
  DrivesOff,
  EmergencyStop,
  DrivesOn,
  Override,  ///< It was changed.
  Ended,     ///< The program.
  Overrun,   ///< The emulator missed cycles itself.
};
constexpr auto enum_names(EventKind) {
  using enum EventKind;
  return names<EventKind>({{Started, "started"},
                           {Answered, "answered"},
                           {Missing, "missing"},
                           {Jump, "jump"},
                           {Limited, "limited"},
                           {DrivesOff, "drives_off"},
                           {EmergencyStop, "emergency_stop"},
                           {DrivesOn, "drives_on"},
                           {Override, "override"},
                           {Ended, "ended"},
                           {Overrun, "overrun"}});
}

struct ControllerEvent {
  double time = 0.0;  ///< [s]
  EventKind kind = EventKind::Started;
  std::uint64_t ipoc = 0;
  double value = 0.0;
  ProgramStop stop = {};

  static void each_field(auto& self, auto&& visit) {
    visit("time", self.time, "Time since the controller began, by its cycles [s].");
    visit("kind", self.kind, "What happened.");
    visit("ipoc", self.ipoc, "IPOC of the last telegram.");
    visit("value", self.value,
          "Of a jump: largest change of an axis or, without corrections of axes, of X, Y or Z [rad or m]; of an "
          "override: its share [-]; of an overrun: missed cycles.");
    visit("stop", self.stop, "Why the program ended.");
  }
};

}  // namespace kr5::rsi
