// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/rsi/controller_files.hpp>
#include <kr5/rsi/emulator.hpp>
#include <kr5/rsi/link_options.hpp>
#include <kr5/work/work_options.hpp>

namespace kr5::work {

/// Both ends of the link that a job runs through, and the network between them.
struct LinkedOptions {
  rsi::TelegramLayout layout;
  rsi::LinkOptions link;
  rsi::EmulatorOptions emulator;

  /// @throws InvalidArgument naming the field, also where the two ends do not agree.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("layout", self.layout, "Telegrams, address and port.");
    visit("link", self.link, "The computer's end.");
    visit("emulator", self.emulator, "The controller's end, and faults of the network.");
  }
};

/// Options by which a link lets the motions of a job pass: absolute corrections in the base, from wherever the arm
/// stands. The controller stops after ten cycles without an answer, since the arm still goes to where it was led.
///
/// A command is ahead of the arm by the lead of its servo, which may turn round in a cycle: limits of the corrections
/// are those of the commands, and far beyond what the arm does. That is limited by `job.motion` and `job.stop`.
/// @param believed Servo and arm, as the job knows them.
/// @throws InvalidArgument for invalid options, or a way that is longer than a correction may be.
LinkedOptions linked_options(const WorkOptions& options, const cell::Cell& believed,
                             rsi::Controller controller = rsi::Controller::Krc4);

/// The program of a real controller with the same limits, for rsi::controller_files.
rsi::ProgramOptions program_options(const LinkedOptions& options);

}  // namespace kr5::work
