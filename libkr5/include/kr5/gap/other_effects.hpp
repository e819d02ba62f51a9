// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <kr5/cell/columns.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/gap/dependence.hpp>
#include <kr5/gap/effect_name.hpp>

/// @file
/// Effects that a diagnosis does not blame: those that come near, those that it could not try, and the experiment that
/// would distinguish what it could not.

namespace kr5::gap {

/// Why an effect that comes near is not blamed.
enum class NotBlamed {
  FitsCheckWorse,        ///< The check experiments fit worse with it.
  WithinSimulatorError,  ///< It explains no more than the simulator may be off.
  LessLikely,            ///< Other sets of effects are more likely.
  StructureRemains,      ///< A column keeps a structure with it.
  Described,             ///< In words of an older file.
};
constexpr auto enum_names(NotBlamed) {
  using enum NotBlamed;
  return names<NotBlamed>({{FitsCheckWorse, "fits_check_worse"},
                           {WithinSimulatorError, "within_simulator_error"},
                           {LessLikely, "less_likely"},
                           {StructureRemains, "structure_remains"},
                           {Described, "described"}});
}

/// An effect that is not blamed, although it comes near.
struct NearestEffect : EffectName {
  double gap = 0.0;
  NotBlamed reason = NotBlamed::LessLikely;
  std::string column = {};
  Variable variable = {};
  std::string note = {};

  static void each_field(auto& self, auto&& visit) {
    EffectName::each_field(self, visit);
    visit("gap", self.gap, "Gap that it leaves beside the causes, over the columns above the floor [-].");
    visit("reason", self.reason,
          "Why it is not blamed: fits_check_worse | within_simulator_error | less_likely | structure_remains | "
          "described.");
    visit("column", self.column, "Kind of experiment and column that keeps most structure with it, e.g. motion.i3.");
    visit("variable", self.variable, "Variable that this structure depends on.");
    visit("note", self.note, "Reason in words of a file of format kr5-gap/1.");
  }
};

/// Why an effect was not tried.
enum class NotTried {
  PartMissing,  ///< The cell lacks a part that it needs.
  NotRecorded,  ///< No recorded column shows it.
  Described,    ///< In words of an older file.
};
constexpr auto enum_names(NotTried) {
  using enum NotTried;
  return names<NotTried>({{PartMissing, "part_missing"}, {NotRecorded, "not_recorded"}, {Described, "described"}});
}

/// An effect of the catalogue that this cell or recording cannot show.
struct UntriedEffect {
  std::string effect;
  std::vector<std::string> targets;
  NotTried reason = NotTried::NotRecorded;
  std::string part = {};
  std::string note = {};

  static void each_field(auto& self, auto&& visit) {
    visit("effect", self.effect, "Id in the catalogue.");
    visit("targets", self.targets, "Targets on which it was not tried; empty: on none.");
    visit("reason", self.reason, "Why: part_missing | not_recorded | described.");
    visit("part", self.part, "Part that the cell lacks.");
    visit("note", self.note, "Reason in words of a file of format kr5-gap/1.");
  }
};

/// Experiment that would distinguish tied effects.
struct NextExperiment {
  std::vector<EffectName> separates;
  std::optional<cell::Kind> kind = {};
  std::string what;
  double seconds = 0.0;     ///< [s]
  double separation = 0.0;  ///< [-]
  bool repeat = false;

  static void each_field(auto& self, auto&& visit) {
    visit("separates", self.separates, "Effects to be distinguished.");
    visit("kind", self.kind, "Kind of the experiment; without: none is known, and `kr5 gap plan` searches for one.");
    visit("what", self.what, "How to do it.");
    visit("seconds", self.seconds, "Duration, set-up included [s].");
    visit("separation", self.separation, "Expected separation of the effects, in standard deviations [-].");
    visit("repeat", self.repeat, "Whether the experiment must be repeated until it settles the question.");
  }
};

}  // namespace kr5::gap
