// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include <kr5/core/fields.hpp>
#include <kr5/rsi/cycles.hpp>
#include <kr5/rsi/telegram_layout.hpp>

/// @file
/// By which rules a controller judges the answers of a computer and corrects its path. What KUKA's documentation leaves
/// open is a field here, and is named as unconfirmed in share/doc/kuka.md.

namespace kr5::rsi {

/// What a controller does with a correction beyond a limit.
enum class LimitAction {
  Stop,  ///< It stops the program.
  Hold,  ///< It holds the correction at the limit.
};
constexpr auto enum_names(LimitAction) {
  return names<LimitAction>({{LimitAction::Stop, "stop"}, {LimitAction::Hold, "hold"}});
}

struct ControllerRules {
  double cycle = short_cycle;  ///< [s]
  double answer_time = 0.004;  ///< [s]
  int max_late = 100;
  std::optional<double> max_late_share = {};  ///< [-]
  int late_window = 1000;
  bool accepts_incomplete = false;
  LimitAction at_limit = LimitAction::Stop;
  double axis_limit = 0.0873;                        ///< [rad]
  double external_limit = 0.005;                     ///< [rad or m]
  double translation_limit = 0.005;                  ///< [m]
  double rotation_limit = 0.0873;                    ///< [rad]
  std::optional<double> axis_per_cycle = {};         ///< [rad or m]
  std::optional<double> translation_per_cycle = {};  ///< [m]
  std::optional<double> rotation_per_cycle = {};     ///< [rad]
  bool relative_repeats_held = false;
  bool override_scales_corrections = false;
  bool sends_while_stopped = true;
  bool greets = false;
  std::uint64_t first_ipoc = 0;
  bool ipoc_restarts = true;
  bool delay_restarts = false;
  std::optional<double> idle_limit = {};  ///< [s]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("cycle", self.cycle, "Time from telegram to telegram [s].");
    visit("answer_time", self.answer_time, "Time from a telegram within which its answer counts [s].");
    visit("max_late", self.max_late, "Cycles in succession without a good answer, with the last of which it stops.");
    visit("max_late_share", self.max_late_share,
          "Share of the cycles of the window without a good answer, on reaching which it stops; none: not judged [-].");
    visit("late_window", self.late_window, "Latest cycles of which the share is taken.");
    visit("accepts_incomplete", self.accepts_incomplete,
          "True where an answer that lacks elements counts; what it lacks follows HOLDON.");
    visit("at_limit", self.at_limit, "What a total correction beyond its limit does: stop | hold (at the limit).");
    visit("axis_limit", self.axis_limit, "Limit of the total correction of an axis, either way [rad].");
    visit("external_limit", self.external_limit, "The same of an external axis [rad or m].");
    visit("translation_limit", self.translation_limit, "The same along X, Y and Z [m].");
    visit("rotation_limit", self.rotation_limit, "The same of the orientation [rad].");
    visit("axis_per_cycle", self.axis_per_cycle,
          "Maximum change of the correction of an axis in a cycle, beyond which it stops; none: no limit [rad or m].");
    visit("translation_per_cycle", self.translation_per_cycle, "The same of a translation; none: no limit [m].");
    visit("rotation_per_cycle", self.rotation_per_cycle, "The same of the orientation; none: no limit [rad].");
    visit("relative_repeats_held", self.relative_repeats_held,
          "True where a relative correction that HOLDON holds is added again in each cycle without an answer.");
    visit("override_scales_corrections", self.override_scales_corrections,
          "True where the override makes corrections smaller, too, not the path alone slower.");
    visit("sends_while_stopped", self.sends_while_stopped,
          "True where telegrams go on while drives are off or an emergency stop holds the arm.");
    visit("greets", self.greets, "True where a connection begins with a telegram of IPOC alone.");
    visit("first_ipoc", self.first_ipoc, "IPOC of the first telegram, mostly milliseconds.");
    visit("ipoc_restarts", self.ipoc_restarts, "True where a reset of the program sets IPOC back to the first.");
    visit("delay_restarts", self.delay_restarts,
          "True where Delay tells the late answers since the last good one, not all of them.");
    visit("idle_limit", self.idle_limit, "Time of relative corrections of zero after which it stops; none: never [s].");
  }
};

/// The rules of a controller as it is delivered.
ControllerRules usual_rules(Controller controller);

}  // namespace kr5::rsi
